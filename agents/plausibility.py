"""Which numbers a robot, a world or an operator can mean; all others are errors.

Every finite number passes the wire, but single precision overflows long before double does: one
such number among the peers' would become infinite in the plan and in everything computed from it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.wire.messages import Reference

# Times the robot's weight, each component of each foot's force: several times what the motors can
# press. A planner that is allowed larger deviations may plan them.
_FORCE_MAX: Final = 10.0
# m, m/s, rad, rad/s: ten times as fast as the motors turn and swing a leg (21 rad/s, 8 m/s); and
# many times what a falling robot reaches.
OUTPUT_MAX: Final = 100.0
_QUAT_NORM2: Final = (0.5, 2.0)  # |q|² of an orientation lies between these
# An operator may ask for what the configuration's own reference may be.
_REFERENCE_LIMITS: Final = {
    name: (key.metadata["low"], key.metadata["high"])
    for name, key in ReferenceConfig.__dataclass_fields__.items()
    if name in ("vx", "vy", "wz", "height")
}


def force_max(robot: RobotSpec) -> float:
    """Greatest component of a foot's force that such a robot can mean, N."""
    return _FORCE_MAX * robot.weight


def is_plausible(config: Config, u: Array, y: Array) -> bool:
    """Whether forces u, (…, 12), N, and outputs y, (…, 6), are numbers that a robot can mean."""
    most = force_max(config.robot) + max(config.planner.deviation_max)
    return _largest(u) <= most and are_plausible_outputs(y)


def are_plausible_outputs(y: Array) -> bool:
    """Whether outputs y, (…, 6), are numbers that a robot can mean."""
    return _largest(y) <= OUTPUT_MAX  # false for NaN


def _largest(array: Array) -> float:
    """Greatest magnitude, NaN if there is one; the method `max` takes twice the time."""
    return float(np.maximum.reduce(np.abs(array), axis=None))


def is_orientation(quat_wxyz: Array) -> bool:
    """Whether a quaternion, (4,), is near enough to unit length to be an orientation."""
    return _QUAT_NORM2[0] < float(quat_wxyz @ quat_wxyz) < _QUAT_NORM2[1]


def is_within_limits(reference: Reference) -> bool:
    """Whether a reference keeps to the limits of `ReferenceConfig`."""
    return all(
        low <= getattr(reference, name) <= high for name, (low, high) in _REFERENCE_LIMITS.items()
    )
