"""What the controller is asked at a tick: the operator's reference with what is planned."""

from __future__ import annotations

import numpy as np

from quadriga.agents.controller.trunk import TrunkCommand
from quadriga.agents.planning.active_plan import Setpoint
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Reference
from quadriga.shared.modes import WALK, Mode
from quadriga.shared.robots.conventions import Array

_ZERO = np.zeros(12)


class Tasks:
    """Fixed data of how plans are followed.

    Args:
        config: the team's configuration.
    """

    def __init__(self, config: Config) -> None:
        self._feedforward = config.planner.interface == "feedforward"
        # Planned height and tilt are in general not tracked: the reference would follow the error.
        self._tracks_all = not self._feedforward and config.planner.tracked == "outputs"

    def build(
        self,
        tick: int,
        mode: Mode,
        reference: Reference,
        setpoint: Setpoint,
        excitation: Array | None,
    ) -> TrunkCommand:
        """The task of one tick.

        Args:
            tick: world time, ms.
            mode: a robot that slows down follows a falling share of the commanded speed.
            reference: in force.
            setpoint: of the plan in force; its deviation counts only while the robot walks.
            excitation: force deviation to add, (12,), N; None: none.
        """
        deviation, planned = setpoint.deviation, setpoint.y_ref
        if excitation is not None:
            deviation = deviation + excitation
        if mode.name != WALK:
            deviation = _ZERO
        factor = mode.speed_factor(tick)
        vx, vy, wz = factor * reference.vx, factor * reference.vy, factor * reference.wz
        height, roll, pitch = reference.height, 0.0, 0.0
        if planned is not None and not self._feedforward:
            vx, vy = float(planned[1]), float(planned[2])
            if self._tracks_all:
                height, _, _, roll, pitch, wz = map(float, planned)
        return TrunkCommand(vx, vy, wz, height, deviation, self._feedforward, roll, pitch)
