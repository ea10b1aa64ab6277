"""Desired accelerations of the trunk: feedback on the outputs and the planner's feed-forward."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rotation import cross, heading, roll_pitch_yaw, wrap_angle
from quadriga.agents.controller.sensed import TrunkState
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_Z_LIMIT = 0.05  # m·s, height integrator
_SPEED_LIMIT = 0.15  # m, speed integrator
_YAW_LIMIT = 0.3  # rad, of the heading error that is acted on


class TrunkGains(NamedTuple):
    """Gains of `feedback`: the keys of these names in the section `controller`, units there."""

    kp_z: float
    kd_z: float
    ki_z: float
    kp_xy: float
    kd_xy: float
    ki_xy: float
    kp_tilt: float
    kd_tilt: float
    kp_yaw: float
    kd_yaw: float
    position_error_limit: float
    leak_xy: float


N_TRUNK_GAINS: Final = len(TrunkGains._fields)


def trunk_gains(config: Config) -> TrunkGains:
    """The gains that a configuration sets."""
    return TrunkGains(*(getattr(config.controller, name) for name in TrunkGains._fields))


class TrunkReference(NamedTuple):
    """What the trunk is to do.

    Attributes:
        v: vx and vy, (2,), m/s, yaw frame.
        wz: yaw rate, rad/s.
        height: of its origin, m, odometry frame.
        tilt: roll and pitch, (2,), rad.
    """

    v: Array
    wz: float
    height: float
    tilt: Array


class Integrators(NamedTuple):
    """What the feedback remembers.

    Attributes:
        height: integral of the height error, m·s.
        speed: leaking integral of the speed error, (2,), m, yaw frame.
        position_error: integral of the speed error, (2,), m, yaw frame, held within
            `position_error_limit`.
        yaw: desired heading, rad.
    """

    height: float
    speed: Array
    position_error: Array
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
    before: Integrators, gains: TrunkGains, trunk: TrunkState, reference: TrunkReference, dt: float
) -> tuple[Integrators, Array, Array]:
    """Accelerations that bring the outputs to their reference.

    Args:
        before: what it remembers.
        gains: of the feedback.
        trunk: where it is and how it moves.
        reference: where and how it should.
        dt: time since the last tick, s.

    Returns:
        What it remembers now, the linear and angular acceleration, (6,), m/s² and rad/s², and the
        desired velocity, (3,), m/s, both in the odometry frame.
    """
    rpy = roll_pitch_yaw(trunk.R)
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    forward, left = reference.v
    v_des = np.array([c * forward - s * left, s * forward + c * left, 0.0])
    out = np.empty(6)
    z_error = reference.height - trunk.position[2]
    height = min(_Z_LIMIT, max(-_Z_LIMIT, before.height + dt * z_error))
    out[2] = gains.kp_z * z_error - gains.kd_z * trunk.velocity[2] + gains.ki_z * height
    speed, position_error, out[:2] = _plane_feedback(before, gains, trunk, reference, c, s, dt)
    yaw = _desired_heading(before.yaw, rpy[2], reference.wz, dt)
    out[3:] = _attitude_feedback(gains, trunk, rpy, yaw, reference)
    return Integrators(height, speed, position_error, yaw), out, v_des


@compiled
def _plane_feedback(
    before: Integrators,
    gains: TrunkGains,
    trunk: TrunkState,
    reference: TrunkReference,
    c: float,
    s: float,
    dt: float,
) -> tuple[Array, Array, Array]:
    """The new speed integral and position error, and the horizontal acceleration, (2,) each.

    c and s are the cosine and sine of the trunk's yaw.
    """
    velocity, limit = trunk.velocity, gains.position_error_limit
    error = reference.v - np.array(
        [c * velocity[0] + s * velocity[1], -s * velocity[0] + c * velocity[1]]
    )
    speed, position_error, push = np.empty(2), np.empty(2), np.empty(2)
    for axis in range(2):
        remaining = (1.0 - dt / gains.leak_xy) * before.speed[axis]
        speed[axis] = min(_SPEED_LIMIT, max(-_SPEED_LIMIT, remaining + dt * error[axis]))
        position_error[axis] = min(
            limit, max(-limit, before.position_error[axis] + dt * error[axis])
        )
        push[axis] = (
            gains.kd_xy * error[axis]
            + gains.ki_xy * speed[axis]
            + gains.kp_xy * position_error[axis]
        )
    acceleration = np.array([c * push[0] - s * push[1], s * push[0] + c * push[1]])
    return speed, position_error, acceleration


@compiled
def _desired_heading(before: float, yaw: float, wz: float, dt: float) -> float:
    """The heading reached by turning on with wz, rad.

    A robot that cannot turn must not be asked for a heading that goes round behind it.
    """
    if wz * wrap_angle(before - yaw) > abs(wz) * _YAW_LIMIT:
        return before
    return wrap_angle(before + dt * wz)


@compiled
def _attitude_feedback(
    gains: TrunkGains, trunk: TrunkState, rpy: Array, yaw_des: float, reference: TrunkReference
) -> Array:
    """Angular acceleration towards tilt and heading asked for, (3,), rad/s², odometry frame."""
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    omega = trunk.R @ trunk.omega
    yaw_error = min(_YAW_LIMIT, max(-_YAW_LIMIT, wrap_angle(yaw_des - rpy[2])))
    # Tilt error about the horizontal axes of the yaw frame, taken to the odometry frame.
    roll_push = gains.kp_tilt * (reference.tilt[0] - rpy[0]) - gains.kd_tilt * (
        c * omega[0] + s * omega[1]
    )
    pitch_push = gains.kp_tilt * (reference.tilt[1] - rpy[1]) - gains.kd_tilt * (
        -s * omega[0] + c * omega[1]
    )
    return np.array(
        [
            c * roll_push - s * pitch_push,
            s * roll_push + c * pitch_push,
            gains.kp_yaw * yaw_error + gains.kd_yaw * (reference.wz - omega[2]),
        ]
    )


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
    deviation: Array, stance: Array, trunk: TrunkState, p_foot: Array, body: SingleRigidBody
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
