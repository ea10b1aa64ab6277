"""Torques that the whole-body QP may count on: what the motors have at the present rates."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import N_JOINTS, N_LEGS, Array
from quadriga.shared.robot.torque_speed import available_torque
from quadriga.shared.runtime.jit import compiled

_LEAST: Final = 0.25  # of the limit: a QP without any torque has no solution, and motors limit too


class MotorLimits(NamedTuple):
    """Limits of the motors by joint, (12,).

    Attributes:
        peak: torque at low speed, N·m.
        corner: speed from which on the torque falls, rad/s; infinite if it does not.
        top: speed at which none is left, rad/s.
    """

    peak: Array
    corner: Array
    top: Array


def motor_limits(config: Config) -> MotorLimits:
    """The limits of a configuration's motors."""
    robot = config.robot
    corner, top = np.tile(robot.corner_speed, N_LEGS), np.tile(robot.speed, N_LEGS)
    if not config.motors.torque_speed:
        corner = np.full(N_JOINTS, np.inf)
    return MotorLimits(robot.torque_limit, corner, top)


@compiled
def torque_bounds(rates: Array, limits: MotorLimits) -> Array:
    """Least and greatest torque of each motor, (2, 12), N·m.

    Args:
        rates: joint rates, (12,), rad/s.
        limits: of the motors.
    """
    bounds = np.empty((2, 12))
    for k in range(12):
        peak = limits.peak[k]
        driving = available_torque(peak, rates[k], limits.corner[k], limits.top[k])
        driving = max(_LEAST * peak, driving)
        bounds[0, k] = -peak if rates[k] > 0.0 else -driving
        bounds[1, k] = driving if rates[k] > 0.0 else peak
    return bounds
