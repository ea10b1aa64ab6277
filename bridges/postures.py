"""Motions that a bridge makes itself, with its gains: up, down, and what it is while at rest."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.robot.conventions import N_JOINTS, N_LEGS, Array
from quadriga.shared.robot.motions import Motion, way_down, way_up
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.unitree.packets import OFF, MotorTargets

DAMPING: Final = 3.0  # N·m·s/rad, of joints that are damped
SINKING: Final = 8.0  # likewise, with which a robot on folded legs comes down on its belly
_PRESSED: Final = 0.6  # of a foot's share of the weight that is put on it, or taken off


def stand_up(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles to the stand; from lying with folded legs it takes `stand_s`."""
    return way_up(q, robot, config.stand_s)


def lie_down(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles down to the folded posture; from the stand it takes `stand_s`."""
    return way_down(q, robot, config.stand_s)


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
