"""What the controller is asked at a tick: the operator's reference with what is planned."""

from __future__ import annotations

import numpy as np

from quadriga.agents.controller.controller import Task
from quadriga.agents.modes import WALK, Mode
from quadriga.agents.planning.active_plan import Setpoint
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Reference
from quadriga.shared.wire.topics import SAMPLE_MS

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
        self._planned_footholds = config.planner.footholds == "planned"
        self._stance_ms = config.gait.stance_ms

    def build(
        self,
        tick: int,
        mode: Mode,
        reference: Reference,
        setpoint: Setpoint,
        excitation: Array | None,
        progress: float,
    ) -> Task:
        """The task of one tick.

        Args:
            tick: world time, ms.
            mode: a robot that slows down follows a falling share of the commanded speed.
            reference: in force.
            setpoint: of the plan in force; its deviation counts only while the robot walks.
            excitation: force deviation to add, (12,), N; None: none.
            progress: of the half cycle, in [0, 1).
        """
        deviation, v_ref = setpoint.deviation, setpoint.v_ref
        if excitation is not None:
            deviation = deviation + excitation
        if mode.name != WALK:
            deviation = _ZERO
        factor = mode.speed_factor(tick)
        vx, vy, wz = factor * reference.vx, factor * reference.vy, factor * reference.wz
        height, roll, pitch = reference.height, 0.0, 0.0
        ahead = None
        if v_ref is not None:
            if not self._feedforward:
                vx, vy = float(v_ref[0, 0]), float(v_ref[0, 1])
            if self._planned_footholds:
                ahead = self._velocity_ahead(v_ref, progress)
        if self._tracks_all and setpoint.y_ref is not None:
            height, _, _, roll, pitch, wz = map(float, setpoint.y_ref)
        return Task(vx, vy, wz, height, deviation, self._feedforward, ahead, roll=roll, pitch=pitch)

    def _velocity_ahead(self, v_ref: Array, progress: float) -> Array:
        """Mean planned velocity until the middle of the next stance, (2,), m/s.

        Early in a swing the plan ends before that: then until its end.
        """
        samples = round((1.5 - progress) * self._stance_ms / SAMPLE_MS)
        mean: Array = v_ref[: max(1, samples)].mean(axis=0)
        return mean
