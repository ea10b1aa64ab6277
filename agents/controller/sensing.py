"""The first half of a tick, compiled: from what the robot senses to where it is and stands."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.contact import ContactRule, contacts_by_force, contacts_by_schedule
from quadriga.agents.controller.estimator import filter_step, foot_trust, noise_parameters
from quadriga.agents.controller.maths.rotation import roll_pitch_yaw
from quadriga.agents.controller.memory import (
    HALF,
    LEVEL,
    LOAD,
    Memory,
    filter_of,
    legs_of,
    swings_of,
)
from quadriga.agents.controller.payload_estimate import felt_load
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import TOTAL_MASS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record

SEEN_SIZE: Final = 72
SWITCHED: Final = 67  # 1 if stances and swings have just ended


@compiled
def coordinates_of(flat: Array) -> tuple[Array, Array]:
    """Views of Pinocchio's q, (19,), and v, (18,), in what was seen."""
    return flat[0:19], flat[19:37]


class Trunk(NamedTuple):
    """Where the trunk is and how it moves.

    Attributes:
        position: of its origin, (3,), m, odometry frame.
        velocity: of its origin, (3,), m/s, odometry frame.
        R: trunk to odometry frame, (3, 3).
        omega: angular velocity, (3,), rad/s, trunk frame.
    """

    position: Array
    velocity: Array
    R: Array
    omega: Array


@compiled
def trunk_of(flat: Array) -> Trunk:
    """Views of the trunk in what was seen."""
    return Trunk(flat[0:3], flat[58:61], flat[37:46].reshape(3, 3), flat[22:25])


@compiled
def feet_of(flat: Array) -> Array:
    """View of the foot centres, (4, 3), m, odometry frame."""
    return flat[46:58].reshape(4, 3)


@compiled
def foot_force_of(flat: Array) -> Array:
    """View of the measured normal forces of the feet, (4,), N."""
    return flat[68:72]


@record
class Sensed:
    """What a robot sees of itself at one tick; `flat` is (72,) and not to be changed.

    Attributes:
        memory: the low level's memory, its estimator and contacts advanced to this tick.
        flat: the rest.
    """

    memory: Memory
    flat: Array

    @property
    def outputs(self) -> Array:
        """The outputs y: z over the ground, vx, vy (yaw frame), roll, pitch, wz. (6,)."""
        return self.flat[61:67]

    @property
    def upright(self) -> float:
        """Cosine of the angle between the trunk's z axis and the vertical."""
        return float(self.flat[45])

    @property
    def position(self) -> Array:
        """Trunk origin, (3,), m, odometry frame."""
        return self.flat[0:3]

    @property
    def velocity(self) -> Array:
        """Of the trunk's origin, (3,), m/s, odometry frame."""
        return self.flat[58:61]

    @property
    def R(self) -> Array:
        """Trunk to odometry frame, (3, 3)."""
        return self.flat[37:46].reshape(3, 3)

    @property
    def p_foot(self) -> Array:
        """Foot centres, (4, 3), m, odometry frame."""
        return self.flat[46:58].reshape(4, 3)


def sensing_constants(config: Config) -> Array:
    """What `sense` needs of the configuration. Shape (15,)."""
    controller, estimator = config.controller, config.estimator
    return np.array(
        [
            estimator.trust_ramp,
            estimator.contact_force,
            float(controller.contact_detection),
            controller.contact_force,
            1e-3 * controller.lost_contact_ms,
            1e-3 * controller.ground_filter_ms,
            controller.liftoff_hold_ms / config.gait.stance_ms,
            1e-3 * controller.reflex_ms,
            float(controller.reject_side_contacts),
            controller.load_time,
            *noise_parameters(estimator),
        ]
    )


@compiled
def sensors_of(row: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Joint angles and rates, attitude, gyro, accelerometer and foot forces in a `State.row`."""
    return row[0:12], row[12:24], row[36:40], row[40:43], row[43:46], row[46:50]


@compiled
def sense(
    memory0: Array,
    state: Array,
    schedule: Array,
    dt: float,
    constants: Array,
    memory: Array,
    seen: Array,
) -> None:
    """Estimate the trunk's state and the contacts.

    From the memory at the last tick, the row of a `State`, the gait's `Schedule.row` and the time
    since the last tick, s, `memory` and `seen` are filled: see `Memory` and `Sensed`.
    `constants` are `sensing_constants`.
    """
    q_joint, v_joint, quat, gyro, accel, foot_force = sensors_of(state)
    stance, progress = schedule[0:4], schedule[4]
    ramp, least_force = constants[0:2]
    trust = foot_trust(stance, progress, foot_force, ramp, least_force)
    mean0, covariance0 = filter_of(memory0)
    mean, covariance, frame = filter_step(
        mean0, covariance0, quat, gyro, accel, q_joint, v_joint, trust, constants[10:15], dt
    )
    place(
        memory0,
        mean,
        covariance,
        quat,
        frame[:3],
        gyro,
        frame[3:],
        q_joint,
        v_joint,
        foot_force,
        schedule,
        dt,
        constants,
        memory,
        seen,
    )


@compiled
def place(
    memory0: Array,
    mean: Array,
    covariance: Array,
    quat: Array,
    R: Array,
    omega: Array,
    p_foot: Array,
    q_joint: Array,
    v_joint: Array,
    foot_force: Array,
    schedule: Array,
    dt: float,
    constants: Array,
    memory: Array,
    seen: Array,
) -> None:
    """The same once the trunk is known: `mean` and `covariance` of the filter, R, its rate."""
    stance, progress, half = schedule[0:4], schedule[4], schedule[5]
    level0 = memory0[LEVEL]
    position, velocity = mean[0], mean[1]
    q, v = coordinates_of(seen)
    q[:3] = position
    norm = np.sqrt(np.sum(quat * quat))
    q[3:6] = quat[1:] / norm
    q[6] = quat[0] / norm
    q[7:] = q_joint
    v[:3] = R.T @ velocity
    v[3:6] = omega
    v[6:] = v_joint
    trunk = trunk_of(seen)
    trunk.R[:] = R
    trunk.velocity[:] = velocity
    feet_of(seen)[:] = p_foot
    foot_force_of(seen)[:] = foot_force
    seen[61:67] = outputs_at(position, velocity, R, omega, level0)

    memory[:] = memory0
    new_mean, new_covariance = filter_of(memory)
    new_mean[:], new_covariance[:] = mean, covariance
    switched = half != memory0[HALF]
    seen[SWITCHED] = 1.0 if switched else 0.0
    (
        by_force,
        least_force,
        lost_after,
        ground_filter,
        hold,
        give_way,
        reject_side_contacts,
        load_time,
    ) = constants[2:10]
    rate = dt / (ground_filter + dt)
    if by_force > 0.5:
        rule = ContactRule(least_force, lost_after, hold, give_way, reject_side_contacts > 0.5)
        legs, level = contacts_by_force(
            legs_of(memory0),
            level0,
            switched,
            stance,
            progress,
            foot_force,
            p_foot[:, 2],
            swings_of(memory),
            rule,
            rate,
            dt,
        )
    else:
        legs, level = contacts_by_schedule(legs_of(memory0)[4], level0, stance, p_foot[:, 2], rate)
    legs_of(memory)[:] = legs
    memory[LEVEL], memory[HALF] = level, half
    if load_time > 0.0:
        memory[LOAD] = felt_load(memory0[LOAD], foot_force, TOTAL_MASS, dt / (load_time + dt))


@compiled
def outputs_at(position: Array, velocity: Array, R: Array, omega: Array, ground: float) -> Array:
    """The outputs y of the planner over ground at a height: z, vx, vy, roll, pitch, wz. (6,)."""
    rpy = roll_pitch_yaw(R)
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    return np.array(
        [
            position[2] - ground,
            c * velocity[0] + s * velocity[1],
            -s * velocity[0] + c * velocity[1],
            rpy[0],
            rpy[1],
            R[2, 0] * omega[0] + R[2, 1] * omega[1] + R[2, 2] * omega[2],
        ]
    )
