"""The constant error of an IMU: of its accelerometer, and of the roll and pitch that it gives.

Both accelerate the trunk seemingly, and the legs deny that. What is vertical is the accelerometer's
error. What is horizontal may be either's: gravity shows in a wrong attitude, too. Only in motion
that no walk makes could they be told apart, so it is shared in proportion to the variances that
the two have on real robots.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.controller.readings import Readings, with_imu
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_LIMIT: Final = 0.5  # m/s²
_FASTEST: Final = 0.5  # s, time constant at first
_TILT_SHARE: Final = 0.3  # of an error of 0.01 rad · g beside one of 0.15 m/s², by variance


@compiled
def without_imu_error(readings: Readings, error: Array) -> Readings:
    """The readings without the error of attitude and accelerometer.

    The attitude becomes q ⊗ (1, −r/2) for its error r: exact to second order, of any norm.

    Args:
        readings: of the sensors.
        error: of the acceleration that they tell, (3,), m/s², trunk frame.
    """
    w, x, y, z = readings.quat_wxyz
    half = 0.5 * _TILT_SHARE / GRAVITY  # an error r of the attitude gives one of g (r × ẑ)
    a, b = half * error[1], -half * error[0]
    quat = np.array([w - x * a - y * b, x + w * a - z * b, y + w * b + z * a, z + x * b - y * a])
    rest = 1.0 - _TILT_SHARE
    return with_imu(
        readings, quat, readings.accel - np.array([rest * error[0], rest * error[1], error[2]])
    )


@compiled
def update_imu_error(
    memory: Array, correction: Array, R: Array, time_constant: float, dt: float
) -> None:
    """Go on with the estimate: what the legs take back of the velocity is the error that is left.

    Args:
        memory: the error, m/s², trunk frame, and the time for which it has been estimated, s, (4,);
            changed in place.
        correction: of the trunk's velocity by the legs at this tick, (3,), m/s, odometry frame.
        R: trunk to odometry frame, (3, 3).
        time_constant: of the estimate, s, once it is that old, before it its age; 0: none is made.
        dt: time since the last tick, s.
    """
    if time_constant <= 0.0:
        return
    memory[3] = min(time_constant, memory[3] + dt)
    left = R.T @ correction / max(_FASTEST, memory[3])
    for axis in range(3):
        memory[axis] = min(_LIMIT, max(-_LIMIT, memory[axis] - left[axis]))
