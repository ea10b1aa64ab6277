"""Motions that a bridge makes itself, up, down, at rest, and one joint at a time."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.robots.conventions import JOINT_NAMES, N_JOINTS, Array
from quadriga.shared.robots.motions import Motion
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.unitree.packets import OFF, MotorTargets

DAMPING: Final = 3.0  # N·m·s/rad, of joints that are damped
SINKING: Final = 8.0  # likewise, with which a robot on folded legs comes down on its belly
WAY: Final = 0.15  # rad that a joint moves
KP: Final = 60.0  # N·m/rad, that holds a hanging leg
KD: Final = 2.0  # N·m·s/rad
TORQUE: Final = 8.0  # N·m, the most that any joint gives
MOST_TRACKING_ERROR: Final = 0.4  # rad off its posture at which a joint stops the test
_OUTWARDS: Final = np.array([1.0, -1.0, 1.0, -1.0])  # sign of a hip's angle, FL FR RL RR
_ROOM: Final = 0.05  # rad that is kept free before an end stop
_BEGIN: Final = 2.0  # s, in which the motors gain their stiffness
_HALF: Final = 0.5  # s, there, and back
_REST: Final = 0.2  # s, before the next joint


def stay(q: Array, seconds: float) -> Motion:
    """No motion for some time."""
    return Motion(np.stack([q, q]), np.array([seconds]))


def towards(q: Array, dq: Array, mode: int, config: BridgeConfig) -> MotorTargets:
    """The command that leads the joints through a posture with the bridge's gains."""
    return _targets(mode, q, dq, config.stand_kp, config.stand_kd)


def damped(q: Array, mode: int, damping: float = DAMPING) -> MotorTargets:
    """The command that damps all joints, by default as those of a robot that stops."""
    return _targets(mode, q, np.zeros(N_JOINTS), 0.0, damping)


def passive(q: Array) -> MotorTargets:
    """The command that switches all motors off."""
    return _targets(OFF, q, np.zeros(N_JOINTS), 0.0, 0.0)


def _targets(mode: int, q: Array, dq: Array, kp: float, kd: float) -> MotorTargets:
    modes, gains = np.full(N_JOINTS, mode, dtype=np.uint8), np.full((2, N_JOINTS), [[kp], [kd]])
    return MotorTargets(modes, q, dq, np.zeros(N_JOINTS), *gains)


def joint_motion(q: Array, robot: RobotSpec) -> Motion:
    """The motion of all joints from measured angles.

    Joints at their stops are led off them, and legs that hang inwards side by side: there they
    touch. For the same reason hips move outwards. All other angles are kept.

    Of its postures, 1 + 3 k is where joint k begins, 2 + 3 k its turning point and 3 + 3 k where it
    is back; the first is where the motors are switched on.
    """
    lower, upper = np.array(robot.lower) + _ROOM, np.array(robot.upper) - _ROOM
    base = np.clip(q, lower, upper)
    base[::3] = _OUTWARDS * np.maximum(_OUTWARDS * base[::3], 0.0)
    sign = np.where(base + WAY <= upper, 1.0, -1.0)
    roomy = _OUTWARDS * base[::3] + WAY <= np.minimum(upper[::3], -lower[::3])
    sign[::3] = np.where(roomy, _OUTWARDS, -_OUTWARDS)
    postures, times = [q, base], [_BEGIN]
    for k in range(N_JOINTS):
        way = np.zeros(N_JOINTS)
        way[k] = sign[k] * WAY
        postures += [base + way, base, base]
        times += [_HALF, _HALF, _REST]
    return Motion(np.stack(postures), np.cumsum(times))


def moving_joint(motion: Motion, seconds: float) -> int | None:
    """Which joint moves then, or rests after it has moved; None before the first."""
    k = (int(np.searchsorted(motion.ends, seconds, side="right")) - 1) // 3
    return None if seconds < _BEGIN else min(k, N_JOINTS - 1)


def led_gently(q: Array, dq: Array, mode: int, seconds: float) -> MotorTargets:
    """The command that leads the joints, softly at first: a wrong order or sign shows early.

    `seconds` count from when the motors were switched on.
    """
    return _targets(mode, q, dq, min(1.0, seconds / _BEGIN) * KP, KD)


def tracking_error(q: Array, asked: Array) -> str:
    """The joint that is farthest off what is asked for, with by how much; "" if all are near."""
    off = q - asked
    worst = int(np.argmax(np.abs(off)))
    far = abs(off[worst]) > MOST_TRACKING_ERROR
    return f"{JOINT_NAMES[worst]} {off[worst]:+.2f} rad" if far else ""
