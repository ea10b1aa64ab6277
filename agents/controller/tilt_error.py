"""The constant error of the roll and pitch that an IMU gives.

With it gravity seems to accelerate the trunk, and the legs deny that.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.controller.maths.rotation import heading
from quadriga.shared.robot.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_LIMIT: Final = 0.05  # rad
_FASTEST: Final = 0.5  # s, time constant at first


@compiled
def without_tilt_error(quat_wxyz: Array, tilt_error: Array) -> Array:
    """A measured attitude, (4,), without its error of roll and pitch, (2,), rad, trunk frame.

    q ⊗ (1, −r/2): exact to second order in the error; of any norm, as what is measured.
    """
    w, x, y, z = quat_wxyz
    a, b = -0.5 * tilt_error[0], -0.5 * tilt_error[1]
    return np.array([w - x * a - y * b, x + w * a - z * b, y + w * b + z * a, z + x * b - y * a])


@compiled
def update_tilt_error(
    memory: Array, correction: Array, R: Array, time_constant: float, dt: float
) -> None:
    """Go on with the estimate of the error of roll and pitch.

    An error r, trunk frame, makes gravity an acceleration g (r × ẑ) of the trunk. What the legs
    take back of the velocity, divided by g, is the error that is left.

    Args:
        memory: the error of roll and pitch, rad, trunk frame, and the time for which it has been
            estimated, s, (3,); changed in place.
        correction: of the trunk's velocity by the legs at this tick, (3,), m/s, odometry frame.
        R: trunk to odometry frame, (3, 3).
        time_constant: of the estimate, s, once it is that old, before it its age; 0: none is made.
        dt: time since the last tick, s.
    """
    if time_constant <= 0.0:
        return
    memory[2] = min(time_constant, memory[2] + dt)
    c, s = heading(R)
    forward = c * correction[0] + s * correction[1]
    left = -s * correction[0] + c * correction[1]
    step = 1.0 / (GRAVITY * max(_FASTEST, memory[2]))
    memory[0] = min(_LIMIT, max(-_LIMIT, memory[0] + step * left))
    memory[1] = min(_LIMIT, max(-_LIMIT, memory[1] - step * forward))
