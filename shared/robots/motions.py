"""Slow motions of a robot's joints through postures, and the way down from any posture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.robots.conventions import N_LEGS, Array
from quadriga.shared.robots.spec import RobotSpec

_UNDER: Final = 0.8  # rad by which a joint may be off a stand of some height, and the legs carry
_BACKWARDS: Final = 1.5  # rad, thigh of a leg whose knee is behind its hip, and not below it
_KNEE_UP: Final = 2.6  # rad, thigh with which a foot cannot push the ground, whatever the calf does
_FOLDING: Final = 5.0  # times as fast as it rises, a robot folds legs that carry nothing
_SHORTEST: Final = 0.15  # of the time from the stand to the ground, a part of a motion


class Motion(NamedTuple):
    """A motion of the joints through postures, each reached at rest."""

    postures: Array  # the first is where it begins, (k, 12), rad
    ends: Array  # when each of the others is reached, (k − 1,), s after the begin, rising

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return float(self.ends[-1])


def way_up(q: Array, robot: RobotSpec, seconds: float) -> Motion:
    """From measured angles to the stand; from lying with folded legs it takes `seconds`.

    A robot whose legs are under it, however far they are folded, goes there directly: where it
    stands already it does not lie down first. Any other folds its legs before it rises.
    """
    ways = [q] if is_on_its_legs(q, robot) else [*_fold(q, robot), robot.q_lying]
    return _through([*ways, robot.q_stand], robot, seconds)


def way_down(q: Array, robot: RobotSpec, seconds: float) -> Motion:
    """From measured angles down to the folded posture; from the stand it takes `seconds`."""
    ways = [q] if is_on_its_legs(q, robot) else _fold(q, robot)
    return _through([*ways, robot.q_lying], robot, seconds)


def is_on_its_legs(q: Array, robot: RobotSpec) -> bool:
    """Whether the feet are about under their hips and about as low as each other.

    Such legs are like those of a stand of some height: hip 0, thigh θ, calf −2 θ.
    """
    calf = float(np.mean(q[2::3]))
    like = np.tile([0.0, -0.5 * calf, calf], N_LEGS)
    return bool((np.abs(q - like) <= _UNDER).all())


def _fold(q: Array, robot: RobotSpec) -> list[Array]:
    """Postures from measured angles to folded legs, some of them with the knee up.

    A leg that is stretched out backwards would pass below the trunk while it is folded, and lift it
    on one side. So its knee goes up first, then it is folded in the air.
    """
    hip, thigh, calf = (slice(k, None, 3) for k in range(3))
    backwards = q[thigh] > _BACKWARDS
    up = q.copy()
    up[thigh] = np.where(backwards, np.maximum(q[thigh], _KNEE_UP), q[thigh])
    folded = up.copy()
    folded[calf] = robot.q_lying[calf]
    folded[hip] = np.where(backwards, robot.q_lying[hip], q[hip])
    return [q, up, folded]


def _through(postures: Sequence[Array], robot: RobotSpec, seconds: float) -> Motion:
    """A part takes as long as the longest way of a joint; the last one moves the trunk, slowly."""
    longest = np.abs(np.diff(np.stack(postures), axis=0)).max(axis=1)
    pace = np.full(len(longest), _FOLDING)
    pace[-1] = 1.0
    share = longest / np.abs(robot.q_stand - robot.q_lying).max() / pace
    return Motion(np.stack(postures), np.cumsum(seconds * np.maximum(_SHORTEST, share)))


def posture_at(motion: Motion, seconds: float) -> tuple[Array, Array]:
    """Angles and rates of a motion, its begin and its end at rest; (12,) each, rad and rad/s.

    Between two postures each joint follows q₀ + (10 s³ − 15 s⁴ + 6 s⁵)(q₁ − q₀), s = 0 … 1.
    """
    k = min(int(np.searchsorted(motion.ends, seconds, side="right")), len(motion.ends) - 1)
    begin = 0.0 if k == 0 else float(motion.ends[k - 1])
    length = float(motion.ends[k]) - begin
    s = min(1.0, max(0.0, (seconds - begin) / length))
    way = motion.postures[k + 1] - motion.postures[k]
    q: Array = motion.postures[k] + s**3 * (10.0 - 15.0 * s + 6.0 * s**2) * way
    dq: Array = 30.0 * s**2 * (1.0 - s) ** 2 / length * way
    return q, dq
