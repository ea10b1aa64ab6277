"""Motions that a bridge makes itself, with its gains: up, down, and what it is while at rest."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.robot.motions import Motion, way_down, way_up
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.unitree.packets import OFF, MotorTargets

DAMPING: Final = 3.0  # N·m·s/rad, of joints that are damped
SINKING: Final = 8.0  # likewise, with which a robot on folded legs comes down on its belly


def stand_up(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles to the stand; from lying with folded legs it takes `stand_s`."""
    return way_up(q, robot, config.stand_s)


def lie_down(q: Array, robot: RobotSpec, config: BridgeConfig) -> Motion:
    """From measured angles down to the folded posture; from the stand it takes `stand_s`."""
    return way_down(q, robot, config.stand_s)


def stay(q: Array, seconds: float) -> Motion:
    """No motion for some time."""
    return Motion(np.stack([q, q]), np.array([seconds]))


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
