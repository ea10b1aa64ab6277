"""The heading of a robot that stands for long: its feet know it better than its IMU.

An IMU's yaw drifts. A trunk that is kept at a drifting heading twists over feet that stand still,
until its legs reach no further, and robots that walk together turn away from each other.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from quadriga.agents.controller.maths.rotation import wrap_angle
from quadriga.agents.controller.memory import MEMORY
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

SETTLED_S: Final = 2.0  # of standing, from which on the feet tell; until then the IMU is better
FOLLOW_S: Final = 1.0  # time constant: encoders' noise stays out of the heading
_FOLLOWS_S: Final = SETTLED_S + 3.0 * FOLLOW_S  # of standing, from which on the drift is averaged
DRIFT_KNOWN_S: Final = _FOLLOWS_S + 2.0  # of standing, from which on the mean is believed
# rad/s. The yaw of an IMU does not drift faster: feet that seem to turn so fast do turn, as those
# of a robot that somebody turns round.
DRIFT_MOST: Final = math.radians(1.0)


@compiled
def keep_heading(memory: Array, stands: bool, p_foot: Array, dt: float) -> None:
    """Have the desired heading turn as the odometry frame does, which drifts with the IMU's yaw.

    While the robot stands, that is how its feet seem to turn; in a walk it is as fast as they
    turned in its last long stand, but for turns that are too fast for a drift.

    Args:
        memory: `Memory.flat`, whose `yaw_des` and memory of the stand are filled.
        stands: whether all feet are meant to stand, and do.
        p_foot: foot centres, (4, 3), m, odometry frame.
        dt: time since the last tick, s.
    """
    yaw_des, drift = memory[MEMORY.yaw_des], memory[MEMORY.yaw_drift]
    stood = memory[MEMORY.stood_s] + dt if stands else 0.0
    memory[MEMORY.stood_s] = stood
    if stood < SETTLED_S:
        if drift != 0.0:
            yaw_des = wrap_angle(yaw_des + dt * drift)
            memory[MEMORY.yaw_des] = yaw_des
        if stands:
            memory[MEMORY.heading_over_feet] = wrap_angle(yaw_des - _heading_of(p_foot))
            memory[MEMORY.drift_mean] = 0.0
        return
    error = wrap_angle(_heading_of(p_foot) + memory[MEMORY.heading_over_feet] - yaw_des)
    rate = error / FOLLOW_S
    memory[MEMORY.yaw_des] = wrap_angle(yaw_des + dt * rate)
    if stood > _FOLLOWS_S and abs(rate) <= DRIFT_MOST:
        share = min(1.0, dt / (stood - _FOLLOWS_S))
        memory[MEMORY.drift_mean] += share * (rate - memory[MEMORY.drift_mean])
    if stood > DRIFT_KNOWN_S:
        memory[MEMORY.yaw_drift] = memory[MEMORY.drift_mean]


@compiled
def _heading_of(p_foot: Array) -> float:
    """Direction from between the hind feet to between the front feet, rad; legs FL FR RL RR."""
    forward = p_foot[0] + p_foot[1] - p_foot[2] - p_foot[3]
    angle: float = np.arctan2(forward[1], forward[0])
    return angle
