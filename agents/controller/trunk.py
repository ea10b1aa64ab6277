"""Desired accelerations of the trunk: feedback on the outputs and the planner's feed-forward."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.estimator.kinematics import cross, heading, roll_pitch_yaw, wrap_angle
from quadriga.shared.robots.conventions import GRAVITY, N_FORCES, N_LEGS, Array
from quadriga.shared.runtime.jit import compiled

SETTLED_S: Final = 2.0  # of standing, from which on the feet tell the heading
FOLLOW_S: Final = 1.0  # time constant: encoders' noise stays out of the heading
_Z_LIMIT: Final = 0.05  # m·s, height integrator
_SPEED_LIMIT: Final = 0.15  # m, speed integrator
# s, of the speed integrator's forgetting: yoked robots share one speed, and without a leak their
# estimators' biases would wind the integrators up against each other.
LEAK: Final = 6.0
POSITION_LIMIT: Final = 0.05  # m, of the position reference's lead
_YAW_LIMIT: Final = 0.3  # rad, of the heading error that is acted on


class TrunkCommand(NamedTuple):
    """What the robot is asked to do at one tick (yaw frame).

    Attributes:
        vx: forward speed, m/s.
        vy: speed to the left, m/s.
        wz: yaw rate, rad/s.
        height: trunk height above the ground, m.
        deviation: planned deviation from the nominal forces, (12,), N; that of legs scheduled to
            swing is not applied.
        feedforward: whether the deviation also becomes accelerations of the trunk.
        roll, pitch: of the trunk, rad.
    """

    vx: float
    vy: float
    wz: float
    height: float
    deviation: Array
    feedforward: bool
    roll: float = 0.0
    pitch: float = 0.0


# The same as compiled code takes it; `new_sample`: a sample of forces begins with this tick.
_NUMBERS: Final = [name for name in TrunkCommand._fields if name != "deviation"]
COMMAND: Final = np.dtype(
    (
        np.record,
        [("deviation", float, N_FORCES), *((name, float) for name in (*_NUMBERS, "new_sample"))],
    )
)


@compiled
def trunk_reference(
    state: np.record, command: np.record, gains: np.record, deviation: Array
) -> Array:
    """Desired acceleration of the trunk, (6,), m/s² and rad/s², odometry frame.

    Integrators and the desired heading go on. `command` is a `COMMAND`, `deviation` that of
    `accumulate_forces`.
    """
    keep_heading(state)
    acc = trunk_feedback(state, command, gains)
    if command.feedforward > 0.5:
        acc += feedforward(state, gains, deviation)
    if gains.flight > 0.5 and np.sum(state.contact) < 0.5:
        # A robot in the air cannot have anything else; asked for more, the QP throws its legs about
        # to move the trunk a little, and the feet are not where the ground will be.
        acc[:] = 0.0
        acc[2] = -GRAVITY
    return acc


@compiled
def accumulate_forces(state: np.record, command: np.record, weight: float) -> Array:
    """Add the planned forces to their sum over the present sample.

    Returns:
        The deviation of the legs scheduled to stand, (12,), N, yaw frame.
    """
    total, stance = state.force_sum, state.stance
    if command.new_sample > 0.5:
        total[:] = 0.0
        state.force_count = 0.0
    state.force_count += 1.0
    share = weight / max(1.0, np.sum(stance))
    deviation = np.zeros(12)
    for i in range(12):
        deviation[i] = command.deviation[i] * stance[i // 3]
        nominal = share * stance[i // 3] if i % 3 == 2 else 0.0
        total[i] += nominal + deviation[i]
    return deviation


@compiled
def keep_heading(state: np.record) -> None:
    """Have the desired heading of a robot that stands for long turn as its feet seem to.

    An IMU's yaw drifts. A trunk that is kept at a drifting heading twists over feet that stand
    still, until its legs reach no further.
    """
    stands = state.half_cycle < 0.0 and np.sum(state.contact) == N_LEGS
    state.stood_s = state.stood_s + state.dt if stands else 0.0
    p_foot = state.p_foot
    forward = p_foot[0] + p_foot[1] - p_foot[2] - p_foot[3]
    heading_of_feet = np.arctan2(forward[1], forward[0])
    if state.stood_s >= SETTLED_S:
        rate = wrap_angle(heading_of_feet + state.heading_over_feet - state.yaw_des) / FOLLOW_S
        state.yaw_des = wrap_angle(state.yaw_des + state.dt * rate)
    elif stands:
        state.heading_over_feet = wrap_angle(state.yaw_des - heading_of_feet)


@compiled
def trunk_feedback(state: np.record, command: np.record, gains: np.record) -> Array:
    """Accelerations that bring the outputs to their reference, (6,), odometry frame."""
    rpy, omega = roll_pitch_yaw(state.R), state.R @ state.omega
    velocity, dt = state.velocity, state.dt
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    acc, in_plane = np.empty(6), np.empty(2)

    z_error = state.ground_height + command.height - state.position[2]
    state.height_integral = min(_Z_LIMIT, max(-_Z_LIMIT, state.height_integral + dt * z_error))
    acc[2] = gains.kp_z * z_error - gains.kd_z * velocity[2] + gains.ki_z * state.height_integral

    vx, vy = command.vx, command.vy
    state.v_des[0], state.v_des[1] = c * vx - s * vy, s * vx + c * vy
    ahead, aside = c * velocity[0] + s * velocity[1], -s * velocity[0] + c * velocity[1]
    integral, position = state.speed_integral, state.position_error
    for axis in range(2):
        error = vx - ahead if axis == 0 else vy - aside
        lasting, led = (1.0 - dt / LEAK) * integral[axis] + dt * error, position[axis] + dt * error
        integral[axis] = min(_SPEED_LIMIT, max(-_SPEED_LIMIT, lasting))
        position[axis] = min(POSITION_LIMIT, max(-POSITION_LIMIT, led))
        in_plane[axis] = gains.kd_xy * error + gains.ki_xy * integral[axis]
        in_plane[axis] += gains.kp_xy * position[axis]
    acc[0], acc[1] = c * in_plane[0] - s * in_plane[1], s * in_plane[0] + c * in_plane[1]

    # A robot that cannot turn must not be asked for a heading that goes round behind it.
    if command.wz * wrap_angle(state.yaw_des - rpy[2]) <= abs(command.wz) * _YAW_LIMIT:
        state.yaw_des = wrap_angle(state.yaw_des + dt * command.wz)
    yaw_error = min(_YAW_LIMIT, max(-_YAW_LIMIT, wrap_angle(state.yaw_des - rpy[2])))
    acc[5] = gains.kp_yaw * yaw_error + gains.kd_yaw * (command.wz - omega[2])

    # Tilt errors about the horizontal axes of the yaw frame, taken to the odometry frame.
    about_x, about_y = c * omega[0] + s * omega[1], -s * omega[0] + c * omega[1]
    roll = gains.kp_tilt * (command.roll - rpy[0]) - gains.kd_tilt * about_x
    pitch = gains.kp_tilt * (command.pitch - rpy[1]) - gains.kd_tilt * about_y
    acc[3], acc[4] = c * roll - s * pitch, s * roll + c * pitch
    return acc


@compiled
def feedforward(state: np.record, gains: np.record, deviation: Array) -> Array:
    """Accelerations that force deviations at the scheduled stance feet give a rigid body, (6,).

    Schedule, not contact, decides which legs count: a contact that comes early or late must
    not put a jump into the feed-forward.

    Returns:
        Linear and angular acceleration, m/s² and rad/s², odometry frame.
    """
    R = state.R
    c, s = heading(R)
    centre = state.position + R @ gains.com
    force, torque = np.zeros(3), np.zeros(3)
    for leg in range(4):
        if state.stance[leg] > 0.5:
            d = deviation[3 * leg : 3 * leg + 3]
            f = np.array([c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]])
            force += f
            torque += cross(state.p_foot[leg] - centre, f)
    out = np.empty(6)
    out[:3] = force / (gains.body_mass + state.payload)
    out[3:] = R @ (gains.inertia_inverse @ (R.T @ torque))
    return out
