"""What the low level remembers from tick to tick, as one flat array: a tick costs one copy of it.

The compiled tick takes and gives the array; `Memory` names its parts for everyone else.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.robot.a1 import Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record

SIZE: Final = 141
LEVEL: Final = 102  # filtered height of the ground under the stance feet, m
HALF: Final = 103  # number of the gait's half period, to notice a switch
HEIGHT: Final = 104  # integral of the height error, m·s
YAW: Final = 105  # desired heading, rad
COUNT: Final = 118  # ticks of the present sample
CAUTION: Final = 139  # what is taken off the friction coefficient
LOAD: Final = 140  # what the robot carries, kg


class Swings(NamedTuple):
    """Of each foot off the ground.

    Attributes:
        lift: progress of the half period at which its swing began, (4,); −1: not yet.
        stumble: time for which it will still give way to what stopped it, (4,), s.
        felt: from where it was stopped at the last tick: the acceleration that was to bring it back
            to its reference, turned round, (4, 3), m/s².
    """

    lift: Array
    stumble: Array
    felt: Array


@compiled
def filter_of(flat: Array) -> tuple[Array, Array]:
    """Views of the estimator's mean, (6, 3), and covariance, (6, 6)."""
    return flat[0:18].reshape(6, 3), flat[18:54].reshape(6, 6)


@compiled
def legs_of(flat: Array) -> Array:
    """View (5, 4), of each leg: contact, early, unloaded, latched, ground."""
    return flat[54:74].reshape(5, 4)


@compiled
def swings_of(flat: Array) -> Swings:
    """Views of what is remembered of the swings."""
    return Swings(flat[119:123], flat[123:127], flat[127:139].reshape(4, 3))


@compiled
def anchors_of(flat: Array) -> tuple[Array, Array]:
    """Views of where swings began and where unloaded stance feet are lowered to, (4, 3) each."""
    return flat[74:86].reshape(4, 3), flat[86:98].reshape(4, 3)


@compiled
def speed_of(flat: Array) -> tuple[Array, Array]:
    """Views of the speed integral and the lead of the position reference, (2,) each."""
    return flat[98:100], flat[100:102]


@compiled
def forces_of(flat: Array) -> Array:
    """View of the sum of the forces applied in the present sample, (12,), N."""
    return flat[106:118]


@record
class Memory:
    """The low level's memory; `flat` is (141,) and not to be changed."""

    flat: Array

    @property
    def mean(self) -> Array:
        """Trunk position, trunk velocity, feet FL FR RL RR, (6, 3), m, m/s, odometry frame."""
        mean, _ = filter_of(self.flat)
        return mean

    @property
    def covariance(self) -> Array:
        """Of the mean, the same for all axes, (6, 6)."""
        _, covariance = filter_of(self.flat)
        return covariance

    @property
    def contact(self) -> Array:
        """1 where the QP may push, (4,)."""
        row: Array = legs_of(self.flat)[0]
        return row

    @property
    def early(self) -> Array:
        """1 where the foot landed before its stance began, (4,)."""
        row: Array = legs_of(self.flat)[1]
        return row

    @property
    def unloaded(self) -> Array:
        """Time without force during stance, (4,), s."""
        row: Array = legs_of(self.flat)[2]
        return row

    @property
    def latched(self) -> Array:
        """1 where the ground has been felt in this stance, (4,)."""
        row: Array = legs_of(self.flat)[3]
        return row

    @property
    def ground(self) -> Array:
        """Height of the ground felt last under each foot, (4,), m, odometry frame."""
        row: Array = legs_of(self.flat)[4]
        return row

    @property
    def level(self) -> float:
        """Filtered height of the ground under the stance feet, m."""
        return float(self.flat[LEVEL])

    @property
    def half(self) -> int:
        """Number of the gait's half period at the last tick."""
        return int(self.flat[HALF])

    @property
    def swing_start(self) -> Array:
        """Where each foot left the ground, (4, 3), m, odometry frame."""
        return anchors_of(self.flat)[0]

    @property
    def foot_goal(self) -> Array:
        """Where a foot that lost contact is being lowered to, (4, 3), m."""
        return anchors_of(self.flat)[1]

    @property
    def lift(self) -> Array:
        """Progress of the half period at which each foot's swing began; −1: not yet. (4,)."""
        return swings_of(self.flat).lift

    @property
    def stumble(self) -> Array:
        """How long each swing foot will still give way to what stopped it, (4,), s."""
        return swings_of(self.flat).stumble

    @property
    def caution(self) -> float:
        """What is taken off the friction coefficient the QP may use, because feet slid."""
        return float(self.flat[CAUTION])

    @property
    def load(self) -> float:
        """What the robot seems to carry, kg."""
        return float(self.flat[LOAD])

    @property
    def felt(self) -> Array:
        """From where each foot off the ground was stopped, see `contact.py`, (4, 3), m/s²."""
        return swings_of(self.flat).felt

    @property
    def height(self) -> float:
        """Integral of the height error, m·s."""
        return float(self.flat[HEIGHT])

    @property
    def speed(self) -> Array:
        """Integral of the speed error, slowly forgotten, yaw frame, (2,), m."""
        return speed_of(self.flat)[0]

    @property
    def lead(self) -> Array:
        """Lead of the position reference over the trunk, yaw frame, (2,), m."""
        return speed_of(self.flat)[1]

    @property
    def yaw(self) -> float:
        """Desired heading, rad."""
        return float(self.flat[YAW])

    @property
    def mean_force(self) -> Array:
        """Mean of the planned forces so far in the present sample, (12,), N, yaw frame."""
        mean: Array = self.flat[106:118] / max(1.0, self.flat[COUNT])
        return mean


def blank() -> Array:
    """The memory of a robot that stands on flat ground at height zero; all else is zero."""
    flat = np.zeros(SIZE)
    contact, _, _, latched, _ = legs_of(flat)
    contact[:] = latched[:] = 1.0
    flat[HALF] = -1.0
    return flat
