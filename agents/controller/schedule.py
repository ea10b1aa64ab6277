"""The gait as the low level takes it: who shall stand at a tick, and how far the half cycle is."""

from __future__ import annotations

from dataclasses import field
from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rows import places
from quadriga.shared.robots.conventions import N_LEGS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record


@record
class Schedule:
    """The gait at one tick.

    Attributes:
        stance: scheduled stance, (4,), 1 or 0.
        progress: progress of the half cycle in [0, 1).
        half_cycle: its number; −1: the robot stands on four feet.
        row: all of it, (6,), see `ScheduleLayout`.
    """

    stance: Array
    progress: float
    half_cycle: int
    row: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", np.array([*self.stance, self.progress, self.half_cycle]))


class ScheduleLayout(NamedTuple):
    """Where `Schedule.row` keeps what."""

    stance: slice
    progress: int
    half_cycle: int


SCHEDULE: Final = ScheduleLayout(**places(stance=N_LEGS, progress=1, half_cycle=1))


class GaitPhase(NamedTuple):
    """A schedule as compiled code takes it.

    Attributes:
        stance: scheduled stance, (4,), 1 or 0.
        progress: progress of the half cycle in [0, 1).
        switched: whether stances and swings have just ended.
    """

    stance: Array
    progress: float
    switched: bool


@compiled
def phase_of(schedule: Array, switched: bool) -> GaitPhase:
    """The phase of a `Schedule.row`."""
    return GaitPhase(schedule[SCHEDULE.stance], schedule[SCHEDULE.progress], switched)
