"""Desired accelerations of the trunk: feedback on the outputs and the planner's feed-forward."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rotation import cross, heading, roll_pitch_yaw, wrap_angle
from quadriga.agents.controller.sensing import Trunk
from quadriga.shared.config.sections import ControllerConfig
from quadriga.shared.robot.a1 import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_Z_LIMIT = 0.05  # m·s, height integrator
_SPEED_LIMIT = 0.15  # m, speed integrator
_YAW_LIMIT = 0.3  # rad, of the heading error that is acted on


def trunk_gains(config: ControllerConfig) -> Array:
    """The gains as `feedback` takes them. Shape (12,)."""
    return np.array(
        [
            config.kp_z,
            config.kd_z,
            config.ki_z,
            config.kp_xy,
            config.kd_xy,
            config.ki_xy,
            config.kp_tilt,
            config.kd_tilt,
            config.kp_yaw,
            config.kd_yaw,
            config.position_error_limit,
            config.leak_xy,
        ]
    )


class Asked(NamedTuple):
    """What the trunk is asked for.

    Attributes:
        v: vx and vy, (2,), m/s, yaw frame.
        wz: yaw rate, rad/s.
        height: of its origin, m, odometry frame.
    """

    v: Array
    wz: float
    height: float


class Integrators(NamedTuple):
    """What the feedback remembers.

    Attributes:
        height: integral of the height error, m·s.
        speed: leaking integral of the speed error, (2,), m, yaw frame.
        lead: of the position reference over the position, (2,), m, yaw frame; held by
            `position_error_limit`.
        yaw: desired heading, rad.
    """

    height: float
    speed: Array
    lead: Array
    yaw: float


class SingleRigidBody(NamedTuple):
    """A robot with massless legs.

    Attributes:
        mass: kg.
        com: centre of mass, (3,), m, trunk frame.
        inertia_inverse: about it, (3, 3), 1/(kg·m²), trunk frame.
    """

    mass: float
    com: Array
    inertia_inverse: Array


@compiled
def feedback(
    before: Integrators, gains: Array, trunk: Trunk, asked: Asked, dt: float
) -> tuple[Integrators, Array, Array]:
    """Accelerations that bring the outputs to what is asked.

    Args:
        before: what it remembers.
        gains: `trunk_gains`.
        trunk: where it is and how it moves.
        asked: where and how it should.
        dt: time since the last tick, s.

    Returns:
        What it remembers now, the linear and angular acceleration, (6,), m/s² and rad/s², and the
        desired velocity, (3,), m/s, both in the odometry frame.
    """
    (
        kp_z,
        kd_z,
        ki_z,
        kp_xy,
        kd_xy,
        ki_xy,
        kp_tilt,
        kd_tilt,
        kp_yaw,
        kd_yaw,
        position_error_limit,
        leak,
    ) = gains
    position, velocity, R, omega_trunk = trunk
    rpy = roll_pitch_yaw(R)
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    omega = R @ omega_trunk
    out = np.empty(6)
    forward, left = asked.v
    v_des = np.array([c * forward - s * left, s * forward + c * left, 0.0])

    z_error = asked.height - position[2]
    height = min(_Z_LIMIT, max(-_Z_LIMIT, before.height + dt * z_error))
    out[2] = kp_z * z_error - kd_z * velocity[2] + ki_z * height

    error = asked.v - np.array(
        [c * velocity[0] + s * velocity[1], -s * velocity[0] + c * velocity[1]]
    )
    speed, lead, push = np.empty(2), np.empty(2), np.empty(2)
    for axis in range(2):
        kept = (1.0 - dt / leak) * before.speed[axis]
        speed[axis] = min(_SPEED_LIMIT, max(-_SPEED_LIMIT, kept + dt * error[axis]))
        lead[axis] = min(
            position_error_limit, max(-position_error_limit, before.lead[axis] + dt * error[axis])
        )
        push[axis] = kd_xy * error[axis] + ki_xy * speed[axis] + kp_xy * lead[axis]
    out[0], out[1] = c * push[0] - s * push[1], s * push[0] + c * push[1]

    # A robot that cannot turn must not be asked for a heading that goes round behind it.
    waits = asked.wz * wrap_angle(before.yaw - rpy[2]) > abs(asked.wz) * _YAW_LIMIT
    yaw = before.yaw if waits else wrap_angle(before.yaw + dt * asked.wz)
    yaw_error = min(_YAW_LIMIT, max(-_YAW_LIMIT, wrap_angle(yaw - rpy[2])))
    # Tilt error about the horizontal axes of the yaw frame, taken to the odometry frame.
    roll_push = -kp_tilt * rpy[0] - kd_tilt * (c * omega[0] + s * omega[1])
    pitch_push = -kp_tilt * rpy[1] - kd_tilt * (-s * omega[0] + c * omega[1])
    out[3] = c * roll_push - s * pitch_push
    out[4] = s * roll_push + c * pitch_push
    out[5] = kp_yaw * yaw_error + kd_yaw * (asked.wz - omega[2])
    return Integrators(height, speed, lead, yaw), out, v_des


@compiled
def fall_freely(trunk: Array, contact: Array) -> None:
    """Ask a robot without contact for free fall, in `trunk` (6,), m/s² and rad/s².

    It cannot have anything else; asked for more, the QP throws its legs about to move the trunk a
    little, and the feet are not where the ground will be.
    """
    if np.sum(contact) < 0.5:
        trunk[:] = 0.0
        trunk[2] = -GRAVITY


@compiled
def feedforward(
    deviation: Array, stance: Array, trunk: Trunk, p_foot: Array, body: SingleRigidBody
) -> Array:
    """Accelerations that force deviations at the scheduled stance feet give a rigid body, (6,).

    Schedule, not contact, decides which legs count: a contact that comes early or late must
    not put a jump into the feed-forward.

    Args:
        deviation: planned, from the nominal forces, (12,), N, yaw frame.
        stance: scheduled stance, (4,), 1 or 0.
        trunk: where it is.
        p_foot: foot centres, (4, 3), m, odometry frame.
        body: what is accelerated.

    Returns:
        Linear and angular acceleration, m/s² and rad/s², odometry frame.
    """
    R = trunk.R
    c, s = heading(R)
    centre = trunk.position + R @ body.com
    force, torque = np.zeros(3), np.zeros(3)
    for leg in range(4):
        if stance[leg] > 0.5:
            d = deviation[3 * leg : 3 * leg + 3]
            f = np.array([c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]])
            force += f
            torque += cross(p_foot[leg] - centre, f)
    out = np.empty(6)
    out[:3] = force / body.mass
    out[3:] = R @ (body.inertia_inverse @ (R.T @ torque))
    return out
