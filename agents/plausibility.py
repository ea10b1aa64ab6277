"""Which numbers a robot, a world or an operator can mean; all others are errors.

Every finite number passes the wire, but single precision overflows long before double does: one
such number among the peers' would become infinite in the plan and in everything computed from it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.messages import Reference, State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled

# Times the robot's weight, each component of each foot's force: a leg that stands carries 1.7 times
# (A1) at its knee's greatest torque. A planner that is allowed larger deviations may plan them.
_FORCE_MAX: Final = 3.0
# m, m/s, rad, rad/s: ten times as fast as the motors turn and swing a leg (21 rad/s, 8 m/s); and
# many times what a falling robot reaches.
OUTPUT_MAX: Final = 100.0
_QUAT_NORM2: Final = (0.5, 2.0)  # |q|² of an orientation lies between these
# What a sensor may say of a robot, even of one that falls: nothing beyond tells anything.
_ANGLE_BEYOND: Final = np.pi  # rad, of a joint beyond its range
_RATE_MAX: Final = 1e3 * np.pi  # rad/s, half a turn in a tick: the other way round is as near
_TORQUE_TIMES: Final = 10.0  # times the motor's
_ACCEL_MAX: Final = 1e4  # m/s², a trunk that comes down at 10 m/s and stops within a tick
_FOOT_MAX: Final = 2.0**15  # a sensor's 16 bits
# An operator may ask for what the configuration's own reference may be.
_REFERENCE_LIMITS: Final = {
    name: (key.metadata["low"], key.metadata["high"])
    for name, key in ReferenceConfig.__dataclass_fields__.items()
    if name in ("vx", "vy", "wz", "height")
}


def is_plausible(config: Config, u: Array, y: Array) -> bool:
    """Whether forces u, (…, 12), N, and outputs y, (…, 6), are numbers that a robot can mean."""
    most = _FORCE_MAX * config.robot.weight + max(config.planner.deviation_max)
    return _largest(u) <= most and are_plausible_outputs(y)


def are_plausible_outputs(y: Array) -> bool:
    """Whether outputs y, (…, 6), are numbers that a robot can mean."""
    return _largest(y) <= OUTPUT_MAX  # false for NaN


def _largest(array: Array) -> float:
    """Greatest magnitude, NaN if there is one; the method `max` takes twice the time."""
    return float(np.maximum.reduce(np.abs(array), axis=None))


@compiled
def is_orientation(quat_wxyz: Array) -> bool:
    """Whether a quaternion, (4,), is near enough to unit length to be an orientation."""
    return bool(_QUAT_NORM2[0] < np.sum(quat_wxyz * quat_wxyz) < _QUAT_NORM2[1])


def measured_limits(robot: RobotSpec) -> Array:
    """Greatest magnitudes of a state's numbers that a sensor can mean. Shape (50,)."""
    angle = np.maximum(np.abs(robot.lower), np.abs(robot.upper)) + _ANGLE_BEYOND
    most = {
        "q_joint": angle,
        "v_joint": _RATE_MAX,
        "tau_joint": _TORQUE_TIMES * robot.torque_limit,
        "imu_quat_wxyz": np.sqrt(_QUAT_NORM2[1]),
        "imu_gyro": _RATE_MAX,
        "imu_accel": _ACCEL_MAX,
        "foot_force": _FOOT_MAX,
    }
    sizes = {name: cut.stop - cut.start for name, cut in State.CUTS.items()}
    return np.concatenate([np.broadcast_to(most[name], size) for name, size in sizes.items()])


@compiled
def is_measurable(row: Array, most: Array) -> bool:
    """Whether all numbers of a state, `State.row`, are some and keep to `measured_limits`.

    In numpy's operations this takes seven times as long: each goes through much code.
    """
    within = True
    for index in range(len(most)):
        within = within and abs(row[index]) <= most[index]
    return within


def is_within_limits(reference: Reference) -> bool:
    """Whether a reference keeps to the limits of `ReferenceConfig`."""
    return all(
        low <= getattr(reference, name) <= high for name, (low, high) in _REFERENCE_LIMITS.items()
    )
