"""Output dynamics of the trunk: desired accelerations from speed, height and heading errors."""

from __future__ import annotations

import numpy as np

from agents.controller.rotation import cross, heading, roll_pitch_yaw, wrap_angle
from shared.config import ControllerConfig
from shared.jit import compiled
from shared.robot import GRAVITY, Array

_Z_LIMIT = 0.05  # m·s, height integrator
_SPEED_LIMIT = 0.15  # m, speed integrator
_YAW_LIMIT = 0.3  # rad, of the heading error that is acted on


def trunk_gains(config: ControllerConfig) -> Array:
    """The gains as the compiled feedback takes them. Shape (12,)."""
    return np.array(
        [
            config.kp_z, config.kd_z, config.ki_z, config.kp_xy, config.kd_xy, config.ki_xy,
            config.kp_tilt, config.kd_tilt, config.kp_yaw, config.kd_yaw, config.leash,
            config.leak_xy,
        ]
    )  # fmt: skip


@compiled
def trunk_acceleration(
    height0: float, speed0: Array, lead0: Array, yaw0: float, gains: Array, position: Array,
    velocity: Array, R: Array, omega: Array, v_yaw_frame: Array, wz: float, z_des: float,
    dt: float, feedforward: bool, deviation: Array, stance: Array, p_foot: Array, mass: float,
    com: Array, inertia_inverse: Array,
) -> tuple[float, Array, Array, float, Array, Array]:  # fmt: skip
    """Desired trunk acceleration: feedback on the outputs plus the planner's feed-forward.

    The integrators are those of `Memory`, `gains` are `trunk_gains`. Position, velocity and R of
    the trunk are in the odometry frame, `omega` in its own. Asked for are vx and vy (2,), the yaw
    rate and a height in the odometry frame; with `feedforward` the planned force deviation, (12,),
    of the scheduled stance feet also becomes accelerations of a single rigid body with mass, `com`
    and `inertia_inverse` in the trunk frame.

    Returns:
        The new integrators, the linear and angular acceleration (6,) and the desired velocity
        (3,), both in the odometry frame.
    """
    height, speed, lead, yaw, trunk, v_des = _feedback(
        height0, speed0, lead0, yaw0, gains, position, velocity, R, omega, v_yaw_frame, wz, z_des,
        dt,
    )  # fmt: skip
    if feedforward:
        trunk += single_rigid_body(
            deviation, stance, R, position, p_foot, mass, com, inertia_inverse
        )
    return height, speed, lead, yaw, trunk, v_des


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
def single_rigid_body(
    deviation: Array, stance: Array, R: Array, position: Array, p_foot: Array, mass: float,
    com: Array, inertia_inverse: Array,
) -> Array:  # fmt: skip
    """Accelerations that force deviations at the scheduled stance feet give a rigid body, (6,).

    Schedule, not contact, decides which legs count: a contact that comes early or late must
    not put a jump into the feed-forward.
    """
    c, s = heading(R)
    centre = position + R @ com
    force, torque = np.zeros(3), np.zeros(3)
    for leg in range(4):
        if stance[leg] > 0.5:
            d = deviation[3 * leg : 3 * leg + 3]
            f = np.array([c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]])
            force += f
            torque += cross(p_foot[leg] - centre, f)
    out = np.empty(6)
    out[:3] = force / mass
    out[3:] = R @ (inertia_inverse @ (R.T @ torque))
    return out


@compiled
def _feedback(
    height0: float, speed0: Array, lead0: Array, yaw0: float, gains: Array, position: Array,
    velocity: Array, R: Array, omega_trunk: Array, v_yaw_frame: Array, wz: float, z_des: float,
    dt: float,
) -> tuple[float, Array, Array, float, Array, Array]:  # fmt: skip
    kp_z, kd_z, ki_z, kp_xy, kd_xy, ki_xy, kp_tilt, kd_tilt, kp_yaw, kd_yaw, leash, leak = gains
    rpy = roll_pitch_yaw(R)
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    omega = R @ omega_trunk
    trunk = np.empty(6)
    forward, left = v_yaw_frame
    v_des = np.array([c * forward - s * left, s * forward + c * left, 0.0])

    height = min(_Z_LIMIT, max(-_Z_LIMIT, height0 + dt * (z_des - position[2])))
    trunk[2] = kp_z * (z_des - position[2]) - kd_z * velocity[2] + ki_z * height

    error = v_yaw_frame - np.array(
        [c * velocity[0] + s * velocity[1], -s * velocity[0] + c * velocity[1]]
    )
    speed, lead, push = np.empty(2), np.empty(2), np.empty(2)
    for axis in range(2):
        kept = (1.0 - dt / leak) * speed0[axis]
        speed[axis] = min(_SPEED_LIMIT, max(-_SPEED_LIMIT, kept + dt * error[axis]))
        lead[axis] = min(leash, max(-leash, lead0[axis] + dt * error[axis]))
        push[axis] = kd_xy * error[axis] + ki_xy * speed[axis] + kp_xy * lead[axis]
    trunk[0], trunk[1] = c * push[0] - s * push[1], s * push[0] + c * push[1]

    # A robot that cannot turn must not be asked for a heading that goes round behind it.
    waits = wz * wrap_angle(yaw0 - rpy[2]) > abs(wz) * _YAW_LIMIT
    yaw = yaw0 if waits else wrap_angle(yaw0 + dt * wz)
    yaw_error = min(_YAW_LIMIT, max(-_YAW_LIMIT, wrap_angle(yaw - rpy[2])))
    # Tilt error about the horizontal axes of the yaw frame, taken to the odometry frame.
    roll_push = -kp_tilt * rpy[0] - kd_tilt * (c * omega[0] + s * omega[1])
    pitch_push = -kp_tilt * rpy[1] - kd_tilt * (-s * omega[0] + c * omega[1])
    trunk[3] = c * roll_push - s * pitch_push
    trunk[4] = s * roll_push + c * pitch_push
    trunk[5] = kp_yaw * yaw_error + kd_yaw * (wz - omega[2])
    return height, speed, lead, yaw, trunk, v_des
