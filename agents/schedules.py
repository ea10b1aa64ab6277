"""One robot's gait at a tick, looked up: stance, progress and number of the half cycle."""

from __future__ import annotations

from quadriga.agents.estimator.robot_state import Schedule
from quadriga.agents.gait import half_cycle_stance, stance_progress
from quadriga.shared.config.sections import Config
from quadriga.shared.modes import STOPPING, WALK, Mode

_STANDING = Schedule(half_cycle_stance(-1).astype(float), 0.5, -1)


class Schedules:
    """Fixed data of one robot's gait.

    Args:
        config: the team's configuration.
        index: the robot's place in the team, 0-based.
    """

    def __init__(self, config: Config, index: int) -> None:
        self._stand_ms = config.gait.stand_ms
        stances = [half_cycle_stance(half_cycle).astype(float) for half_cycle in (0, 1)]
        self._cycle: list[Schedule] = []  # from the end of the stand on
        for since in range(2 * config.gait.stance_ms):
            progress, half_cycle = stance_progress(config, index, self._stand_ms + since)
            self._cycle.append(Schedule(stances[half_cycle], progress, half_cycle))

    def at(self, tick: int, mode: Mode) -> Schedule:
        """The gait at `tick`; in modes without a trot all four legs stand."""
        if mode.name not in (WALK, STOPPING):
            return _STANDING
        return self._cycle[(tick - self._stand_ms) % len(self._cycle)]
