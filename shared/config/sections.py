"""The whole configuration: frozen dataclasses; every key has a default, a unit and limits."""

from __future__ import annotations

from dataclasses import dataclass, field

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.identification import IdentificationConfig
from quadriga.shared.config.low_level import ControllerConfig, EstimatorConfig, GaitConfig
from quadriga.shared.config.motors import MotorsConfig
from quadriga.shared.config.planner import PlannerConfig
from quadriga.shared.config.reference import ReferenceConfig
from quadriga.shared.config.sensors import SensorsConfig
from quadriga.shared.config.team import (
    BRIDGED,
    SIMULATED,
    BusConfig,
    RecorderConfig,
    RuntimeConfig,
    TeamConfig,
)
from quadriga.shared.config.world import WorldConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.spec import RobotSpec

__all__ = [
    "BRIDGED",
    "SIMULATED",
    "BridgeConfig",
    "BusConfig",
    "Config",
    "ControllerConfig",
    "EstimatorConfig",
    "GaitConfig",
    "IdentificationConfig",
    "MotorsConfig",
    "PlannerConfig",
    "RecorderConfig",
    "ReferenceConfig",
    "RuntimeConfig",
    "SensorsConfig",
    "TeamConfig",
    "WorldConfig",
]


@dataclass(frozen=True, slots=True)
class Config:
    """The configuration of a team, one section per field."""

    team: TeamConfig = field(default_factory=TeamConfig)
    bus: BusConfig = field(default_factory=BusConfig)
    world: WorldConfig = field(default_factory=WorldConfig)
    sensors: SensorsConfig = field(default_factory=SensorsConfig)
    motors: MotorsConfig = field(default_factory=MotorsConfig)
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    gait: GaitConfig = field(default_factory=GaitConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    identification: IdentificationConfig = field(default_factory=IdentificationConfig)
    reference: ReferenceConfig = field(default_factory=ReferenceConfig)
    recorder: RecorderConfig = field(default_factory=RecorderConfig)
    runtime: RuntimeConfig = field(default_factory=RuntimeConfig)
    bridge: BridgeConfig = field(default_factory=BridgeConfig)

    @property
    def robot(self) -> RobotSpec:
        """The kind of robot that the team is made of.

        Raises:
            ConfigError: it is that of a recording, and not known here.
        """
        kind = self.team.robot
        if kind not in ROBOTS:
            known = f"one of {', '.join(ROBOTS)}"
            raise ConfigError("team.robot", repr(kind), known, "install what brings this robot")
        return ROBOTS[kind]

    @property
    def feet_measure_newtons(self) -> bool:
        """Whether foot forces of messages are N, and not counts of unknown scale and bias."""
        return self.team.plant == SIMULATED and self.sensors.foot_sensor == "newtons"

    @property
    def response_file(self) -> str:
        """The file of measured responses for a team of this size; empty if none is configured."""
        return self.identification.response.replace("{robots}", str(self.team.robots))
