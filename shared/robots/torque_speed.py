"""How much torque a motor has at a speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadriga.shared.robots.conventions import N_LEGS, Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled


class MotorCurves(NamedTuple):
    """Torque-speed curves of a robot's motors, by joint, (12,)."""

    peak: Array  # torque that stands or brakes, N·m
    driving: Array  # torque along the joint's own rotation, up to the corner speed, N·m
    corner: Array  # speed from which on the driving torque falls, rad/s; infinite if it does not
    top: Array  # speed at which none is left, rad/s


def motor_curves(robot: RobotSpec, *, torque_speed: bool) -> MotorCurves:
    """The motors of a robot; without `torque_speed` they have their peak torque always."""
    speeds = robot.corner_speed if torque_speed else (np.inf, np.inf, np.inf)
    driving = robot.driving_torque if torque_speed else robot.torque
    rows = (robot.torque, driving, speeds, robot.speed)
    return MotorCurves(*(np.tile(row, N_LEGS) for row in rows))


@compiled
def torque_range(rate: float, curves: MotorCurves, k: int) -> tuple[float, float]:
    """Least and greatest torque of a motor, N·m.

    Its voltage is limited: from the corner speed on, the driving torque falls linearly. A motor
    that brakes has its peak. The rate is that of joint `k`, rad/s.
    """
    peak, driving = curves.peak[k], curves.driving[k]
    if abs(rate) > curves.corner[k]:
        left = max(0.0, curves.top[k] - abs(rate))
        driving *= left / (curves.top[k] - curves.corner[k])
    if rate > 0.0:
        return -peak, driving
    if rate < 0.0:
        return -driving, peak
    return -peak, peak
