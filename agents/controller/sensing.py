"""The first half of a tick, compiled: from what the robot senses to where it is and stands."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.contact import (
    N_CONTACT_RULE,
    ContactRule,
    contact_rule,
    update_contacts,
)
from quadriga.agents.controller.estimator import (
    N_NOISE,
    Estimate,
    FilterBody,
    FilterNoise,
    filter_noise,
    filter_step,
    foot_trust,
)
from quadriga.agents.controller.maths.rotation import roll_pitch_yaw
from quadriga.agents.controller.maths.rows import numbers, places
from quadriga.agents.controller.memory import MEMORY, FilterState, feet_memory_of, filter_state_of
from quadriga.agents.controller.payload_estimate import estimate_load
from quadriga.agents.controller.readings import readings_of
from quadriga.agents.controller.schedule import SCHEDULE, phase_of
from quadriga.agents.controller.sensed import SENSED, feet_of, trunk_of
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import N_GEOMETRY, Geometry
from quadriga.shared.runtime.jit import compiled


class SensingLayout(NamedTuple):
    """Where the row of `sensing_constants` keeps what.

    Attributes:
        trust_ramp: share of stance in which trust in a foot ramps up and down.
        least_force: below which a foot is not trusted, N.
        load_time: time constant of the load's filter, s; 0: no load is estimated.
        noise: `FilterNoise`.
        rule: `ContactRule`.
        geometry: `Geometry`.
        imu: where the accelerometer is, (3,), m, trunk frame.
    """

    trust_ramp: int
    least_force: int
    load_time: int
    noise: slice
    rule: slice
    geometry: slice
    imu: slice


_CONSTANTS: Final = SensingLayout(
    **places(
        trust_ramp=1,
        least_force=1,
        load_time=1,
        noise=N_NOISE,
        rule=N_CONTACT_RULE,
        geometry=N_GEOMETRY,
        imu=3,
    )
)


_MASS: Final = _CONSTANTS.geometry.start + Geometry._fields.index("mass")


def sensing_constants(config: Config) -> Array:
    """What `sense` needs of the configuration and its robot, see `SensingLayout`."""
    estimator, robot = config.estimator, config.robot
    ahead = [estimator.trust_ramp, estimator.contact_force, config.controller.load_time]
    return np.concatenate(
        [ahead, filter_noise(estimator), contact_rule(config), robot.geometry, robot.imu]
    )


@compiled
def sense(
    memory0: Array,
    state: Array,
    schedule: Array,
    dt: float,
    constants: Array,
    memory: Array,
    sensed: Array,
) -> None:
    """Estimate the trunk's state and the contacts.

    Args:
        memory0: `Memory.flat` of the last tick.
        state: `State.row`.
        schedule: `Schedule.row`.
        dt: time since the last tick, s.
        constants: `sensing_constants`.
        memory: the new `Memory.flat`, filled.
        sensed: `Sensed.flat`, filled.
    """
    readings = readings_of(state)
    trust = foot_trust(
        schedule[SCHEDULE.stance],
        schedule[SCHEDULE.progress],
        readings.foot_force,
        constants[_CONSTANTS.trust_ramp],
        constants[_CONSTANTS.least_force],
    )
    noise = FilterNoise(*numbers(constants[_CONSTANTS.noise], N_NOISE))
    geometry = Geometry(*numbers(constants[_CONSTANTS.geometry], N_GEOMETRY))
    body = FilterBody(geometry, constants[_CONSTANTS.imu])
    filtered, estimate = filter_step(filter_state_of(memory0), readings, trust, noise, body, dt)
    place(memory0, filtered, estimate, schedule, dt, constants, memory, sensed)


@compiled
def place(
    memory0: Array,
    filtered: FilterState,
    estimate: Estimate,
    schedule: Array,
    dt: float,
    constants: Array,
    memory: Array,
    sensed: Array,
) -> None:
    """The same once the estimate is known; `filtered` is the estimator's new memory."""
    ground_height0 = memory0[MEMORY.ground_height]
    switched = schedule[SCHEDULE.half_cycle] != memory0[MEMORY.half_cycle]
    _fill(sensed, estimate, ground_height0, switched)

    memory[:] = memory0
    memory[MEMORY.half_cycle] = schedule[SCHEDULE.half_cycle]
    new = filter_state_of(memory)
    new.mean[:], new.covariance[:] = filtered
    memory[MEMORY.ground_height] = update_contacts(
        feet_memory_of(memory),
        ground_height0,
        phase_of(schedule, switched),
        estimate.foot_force,
        estimate.p_foot[:, 2],
        ContactRule(*numbers(constants[_CONSTANTS.rule], N_CONTACT_RULE)),
        dt,
    )
    load_time = constants[_CONSTANTS.load_time]
    if load_time > 0.0:
        rate = dt / (load_time + dt)
        memory[MEMORY.load] = estimate_load(
            memory0[MEMORY.load], estimate.foot_force, constants[_MASS], rate
        )


@compiled
def _fill(sensed: Array, estimate: Estimate, ground_height: float, switched: bool) -> None:
    """Fill `Sensed.flat`; `ground_height` is the one over which the output z counts, m."""
    quat, R, velocity = estimate.quat_wxyz, estimate.R, estimate.velocity
    norm = np.sqrt(np.sum(quat * quat))
    sensed[SENSED.position] = estimate.position
    quat_xyzw = sensed[SENSED.quat_xyzw]
    quat_xyzw[:3] = quat[1:] / norm
    quat_xyzw[3] = quat[0] / norm
    sensed[SENSED.q_joint] = estimate.q_joint
    sensed[SENSED.v_trunk] = R.T @ velocity
    sensed[SENSED.omega] = estimate.omega
    sensed[SENSED.v_joint] = estimate.v_joint
    trunk_of(sensed).R[:] = R
    feet_of(sensed)[:] = estimate.p_foot
    sensed[SENSED.velocity] = velocity
    sensed[SENSED.foot_force] = estimate.foot_force
    sensed[SENSED.outputs] = outputs_at(
        estimate.position, velocity, R, estimate.omega, ground_height
    )
    sensed[SENSED.switched] = 1.0 if switched else 0.0


@compiled
def outputs_at(position: Array, velocity: Array, R: Array, omega: Array, ground: float) -> Array:
    """The outputs y of the planner over ground at a height, m: z, vx, vy, roll, pitch, wz. (6,)."""
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
