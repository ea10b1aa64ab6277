"""Torques that the whole-body QP may count on: what the motors have at the present rates."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.torque_speed import MotorCurves, torque_range
from quadriga.shared.runtime.jit import compiled

_LEAST: Final = 0.25  # of the limit: a QP without any torque has no solution, and motors limit too


@compiled
def torque_bounds(rates: Array, curves: MotorCurves) -> Array:
    """Least and greatest torque of each motor, (2, 12), N·m.

    Args:
        rates: joint rates, (12,), rad/s.
        curves: of the motors.
    """
    bounds = np.empty((2, 12))
    for k in range(12):
        least = _LEAST * curves.peak[k]
        lower, upper = torque_range(rates[k], curves, k)
        bounds[0, k], bounds[1, k] = min(lower, -least), max(upper, least)
    return bounds
