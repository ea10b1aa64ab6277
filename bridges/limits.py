"""What a bridge lets through to the motors, whatever it is asked for."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.plant.commands import MOST_KD, MOST_KP
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.unitree.packets import MotorTargets

TOO_FAST: Final = 2.0  # times a joint's greatest speed: no joint moves so
TOO_FAR: Final = 1.0  # rad beyond its range: no joint is there
# In the order in which they are applied.
LIMITS: Final = (
    "finite",
    "measured",
    "gain",
    "position",
    "speed",
    "torque",
    "rate",
    "end-stop",
    "power",
)
_FINITE, _MEASURED, _GAIN, _POSITION, _SPEED, _TORQUE, _RATE, _END_STOP, _POWER = range(len(LIMITS))


class JointLimits(NamedTuple):
    """Limits as compiled code takes them; arrays (12,)."""

    lower: Array
    upper: Array
    speed: Array
    torque: Array
    torque_rate: float
    power: float


class Limited(NamedTuple):
    """A command within the limits."""

    targets: MotorTargets  # what may be sent
    torque: Array  # that the motors will give at the measured angles and rates, (12,), N·m
    cut: tuple[str, ...]  # names of the limits that had to be applied, of `LIMITS`


def joint_limits(config: BridgeConfig, robot: RobotSpec) -> JointLimits:
    """The limits of a kind of robot."""
    return JointLimits(
        lower=np.array(robot.lower) + config.joint_margin,
        upper=np.array(robot.upper) - config.joint_margin,
        speed=np.tile(robot.speed, 4),
        torque=config.torque_share * robot.torque_limit,
        torque_rate=config.torque_rate,
        power=config.power_max,
    )


@compiled
def _is_known(k: int, q: Array, dq: Array, limits: JointLimits) -> bool:
    """Whether a true sensor could say this of joint k."""
    near = limits.lower[k] - TOO_FAR <= q[k] <= limits.upper[k] + TOO_FAR
    return bool(near and abs(dq[k]) <= TOO_FAST * limits.speed[k])


@compiled
def shares_of_speed(q: Array, dq: Array, fastest: Array, limits: JointLimits) -> Array:
    """How fast each joint is, (12,): beyond 1 too fast, ∞ if no true sensor could say this of it.

    Args:
        q: measured angles, rad.
        dq: measured rates, rad/s.
        fastest: above which a joint is too fast, (12,), rad/s.
        limits: of this robot.
    """
    shares = np.empty(N_JOINTS)
    for k in range(N_JOINTS):
        shares[k] = abs(dq[k]) / fastest[k] if _is_known(k, q, dq, limits) else np.inf
    return shares


def limit_targets(
    targets: MotorTargets, q: Array, dq: Array, before: Array, ms: int, limits: JointLimits
) -> Limited:
    """Bring a command within all limits.

    The torque that counts is the one that the motor will give, tau + kp (q − q_measured) +
    kd (dq − dq_measured); what must be taken off it is taken off the feed-forward torque. Gains,
    angles and rates are limited first. Where a joint is at its end stop, no torque pushes it on.
    Where that would need a feed-forward torque beyond the motor's limit, the command has no gains
    and its torque alone. What is measured of a joint may be wrong (see `shares_of_speed`): then
    nothing is made up for, and the joint has damping alone of its gains.

    Args:
        targets: what is asked for; numbers that are none count as zero.
        q: measured angles, (12,), rad.
        dq: measured rates, (12,), rad/s.
        before: the torque of the last command, (12,), N·m.
        ms: since then.
        limits: of this robot.
    """
    asked = np.array([targets.tau, targets.q, targets.dq, targets.kp, targets.kd])
    torque, applied = np.empty(N_JOINTS), np.zeros(len(LIMITS), dtype=np.bool_)
    _limit(asked, q, dq, before, float(ms), limits, torque, applied)
    tau, angle, rate, kp, kd = asked
    cut = tuple(name for name, was in zip(LIMITS, applied.tolist(), strict=True) if was)
    return Limited(MotorTargets(targets.mode, angle, rate, tau, kp, kd), torque, cut)


@compiled
def _limit(
    asked: Array,
    q: Array,
    dq: Array,
    before: Array,
    ms: float,
    limits: JointLimits,
    torque: Array,
    applied: NDArray[np.bool_],
) -> None:
    """Limit the rows tau, q, dq, kp, kd of `asked` in place; fill `torque` and `applied`."""
    power = 0.0
    for k in range(N_JOINTS):
        for row in range(5):
            if not math.isfinite(asked[row, k]):
                asked[row, k], applied[_FINITE] = 0.0, True
        known = _is_known(k, q, dq, limits)
        at, moving = (q[k], dq[k]) if known else (0.0, 0.0)
        applied[_MEASURED] |= not known
        kp, kd = min(max(asked[3, k], 0.0), MOST_KP), min(max(asked[4, k], 0.0), MOST_KD)
        applied[_GAIN] |= kp != asked[3, k] or kd != asked[4, k]
        if not known:
            kp = 0.0
        # Without a gain the angle or rate that is asked for means nothing.
        angle, rate = at, 0.0
        if kp > 0.0:
            angle = min(max(asked[1, k], limits.lower[k]), limits.upper[k])
            applied[_POSITION] |= angle != asked[1, k]
        if kd > 0.0:
            rate = min(max(asked[2, k], -limits.speed[k]), limits.speed[k])
            applied[_SPEED] |= rate != asked[2, k]
        spring = kp * (angle - at) + kd * (rate - moving)
        wanted = asked[0, k] + spring
        given = min(max(wanted, -limits.torque[k]), limits.torque[k])
        applied[_TORQUE] |= given != wanted
        step = limits.torque_rate * ms
        slow = min(max(given, before[k] - step), before[k] + step)
        applied[_RATE] |= slow != given
        past = at >= limits.upper[k] if slow > 0.0 else at <= limits.lower[k]
        if known and past and slow != 0.0:
            slow, applied[_END_STOP] = 0.0, True
        torque[k] = slow
        power += max(slow * moving, 0.0)
        if abs(slow - spring) > limits.torque[k]:
            kp, kd, spring = 0.0, 0.0, 0.0
        asked[0, k], asked[1, k], asked[2, k] = slow - spring, angle, rate
        asked[3, k], asked[4, k] = kp, kd
    if power > limits.power:
        applied[_POWER] = True
        for k in range(N_JOINTS):
            if torque[k] * dq[k] > 0.0 and abs(dq[k]) <= TOO_FAST * limits.speed[k]:
                less = torque[k] * (limits.power / power)
                asked[0, k] += less - torque[k]
                torque[k] = less
                if abs(asked[0, k]) > limits.torque[k]:
                    asked[0, k], asked[3, k], asked[4, k] = less, 0.0, 0.0
