"""Slow motions that a bridge makes itself: from any posture to standing, and down again."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.robot.conventions import N_JOINTS, N_LEGS, Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.unitree.packets import OFF, MotorTargets

DAMPING: Final = 3.0  # N·m·s/rad, of joints that are damped
SINKING: Final = 8.0  # likewise, with which a robot on folded legs comes down on its belly
_UNDER: Final = 0.8  # rad by which a joint may be off a stand of some height, and the legs carry
_BACKWARDS: Final = 1.5  # rad, thigh of a leg whose knee is behind its hip, and not below it
_KNEE_UP: Final = 2.6  # rad, thigh with which a foot cannot push the ground, whatever the calf does
_FOLDING: Final = 5.0  # times as fast as it rises, a robot folds legs that carry nothing
_PRESSED: Final = 0.6  # of a foot's share of the weight that is put on it, or taken off
_SHORTEST: Final = 0.15  # of `stand_s`, a part of a motion


class Motion(NamedTuple):
    """A motion of the joints through postures, each reached at rest.

    Attributes:
        postures: the first is where it begins, (k, 12), rad.
        ends: when each of the others is reached, (k − 1,), s after the begin, rising.
    """

    postures: Array
    ends: Array

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return float(self.ends[-1])


def stand_up(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles to the stand; from lying with folded legs it takes `stand_s`.

    A robot whose legs are under it, however far they are folded, goes there directly: where it
    stands already it does not lie down first. Any other folds its legs before it rises.
    """
    ways = [q] if is_on_its_legs(q, robot) else [*_fold(q, robot), robot.q_lying]
    return _through([*ways, robot.q_stand], robot, config)


def lie_down(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles down to the folded posture; from the stand it takes `stand_s`."""
    ways = [q] if is_on_its_legs(q, robot) else _fold(q, robot)
    return _through([*ways, robot.q_lying], robot, config)


def stay(q: Array, seconds: float) -> Motion:
    """No motion for some time."""
    return Motion(np.stack([q, q]), np.array([seconds]))


def press_by_diagonals(robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From the stand, the weight more on one diagonal of feet, then on the other, and back.

    The trunk stays where it is: the forces that are added cancel each other. So robots that are
    yoked do not pull at each other. A joint that is asked for an angle that is off by δτ / k_p
    gives δτ more; for a foot that is under its hip, all of it is the calf's.
    """
    lever = robot.geometry.link * np.sin(robot.q_stand[1])  # m, of the foot from its knee
    more = _PRESSED * robot.weight / N_LEGS * lever / config.stand_kp
    first = robot.q_stand.copy()
    first[2::3] += np.array([more, -more, -more, more])
    second = 2.0 * robot.q_stand - first
    postures = [robot.q_stand, first, first, second, second, robot.q_stand]
    return Motion(np.stack(postures), np.cumsum([0.5, 0.4, 0.8, 0.4, 0.5]))


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


def _through(postures: list[Array], robot: RobotSpec, config: BridgeConfig) -> Motion:
    """A part takes as long as the longest way of a joint; the last one moves the trunk, slowly."""
    longest = np.abs(np.diff(np.stack(postures), axis=0)).max(axis=1)
    pace = np.full(len(longest), _FOLDING)
    pace[-1] = 1.0
    share = longest / np.abs(robot.q_stand - robot.q_lying).max() / pace
    return Motion(np.stack(postures), np.cumsum(config.stand_s * np.maximum(_SHORTEST, share)))


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


def towards(q: Array, dq: Array, mode: int, config: BridgeConfig) -> MotorTargets:
    """The command that leads the joints through a posture with the bridge's gains."""
    gains = np.full(N_JOINTS, config.stand_kp), np.full(N_JOINTS, config.stand_kd)
    return MotorTargets(_modes(mode), q, dq, np.zeros(N_JOINTS), *gains)


def damped(q: Array, mode: int, damping: float = DAMPING) -> MotorTargets:
    """The command that damps all joints, by default as those of a robot that stops."""
    zero = np.zeros(N_JOINTS)
    return MotorTargets(_modes(mode), q, zero, zero, zero, np.full(N_JOINTS, damping))


def passive(q: Array) -> MotorTargets:
    """The command that switches all motors off."""
    zero = np.zeros(N_JOINTS)
    return MotorTargets(_modes(OFF), q, zero, zero, zero, zero)


def _modes(mode: int) -> NDArray[np.uint8]:
    return np.full(N_JOINTS, mode, dtype=np.uint8)
