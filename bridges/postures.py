"""Slow motions that a bridge makes itself: from any posture to standing, and down again."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.unitree.packets import OFF, MotorTargets

DAMPING: Final = 3.0  # N·m·s/rad, of joints that are damped
_FIRST: Final = 0.4  # share of standing up in which the legs are folded


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
    """From measured angles over the folded posture, if the robot is lower, to the stand."""
    first = _FIRST * config.stand_s
    return Motion(np.stack([q, robot.q_lying, robot.q_stand]), np.array([first, config.stand_s]))


def lie_down(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles down to the folded posture."""
    return Motion(np.stack([q, robot.q_lying]), np.array([config.stand_s]))


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


def damped(q: Array, mode: int) -> MotorTargets:
    """The command that damps all joints."""
    zero = np.zeros(N_JOINTS)
    return MotorTargets(_modes(mode), q, zero, zero, zero, np.full(N_JOINTS, DAMPING))


def passive(q: Array) -> MotorTargets:
    """The command that switches all motors off."""
    zero = np.zeros(N_JOINTS)
    return MotorTargets(_modes(OFF), q, zero, zero, zero, zero)


def _modes(mode: int) -> NDArray[np.uint8]:
    return np.full(N_JOINTS, mode, dtype=np.uint8)
