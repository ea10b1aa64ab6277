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
    specific_force_at_origin,
)
from quadriga.agents.controller.foot_load import (
    N_FOOT_LOAD_RULE,
    FootLoadRule,
    foot_load_rule,
    update_foot_load,
)
from quadriga.agents.controller.imu_error import update_imu_error, without_imu_error
from quadriga.agents.controller.maths.leg_reaction import LegMotion
from quadriga.agents.controller.maths.links import LINK_SIZE, N_LINKS
from quadriga.agents.controller.maths.rotation import roll_pitch_yaw, rotation_matrix
from quadriga.agents.controller.maths.rows import numbers, places
from quadriga.agents.controller.memory import MEMORY, FilterState, feet_memory_of, filter_state_of
from quadriga.agents.controller.payload_estimate import estimate_load
from quadriga.agents.controller.readings import Readings, readings_of
from quadriga.agents.controller.schedule import SCHEDULE, phase_of
from quadriga.agents.controller.sensed import SENSED, feet_of, trunk_of
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.spec import N_GEOMETRY, Geometry
from quadriga.shared.runtime.jit import compiled


class SensingLayout(NamedTuple):
    """Where the row of `sensing_constants` keeps what.

    Attributes:
        trust_ramp: share of stance in which trust in a foot ramps up and down.
        least_force: below which a foot is not trusted, N.
        tilt_time: time constant of the IMU's error, s; 0: none is assumed.
        load_time: time constant of the load's filter, s; 0: no load is estimated.
        noise: `FilterNoise`.
        rule: `ContactRule`.
        geometry: `Geometry`.
        imu: where the accelerometer is, (3,), m, trunk frame.
        foot_load: `FootLoadRule`.
        links: `link_table`, (13, 14).
    """

    trust_ramp: int
    least_force: int
    load_time: int
    tilt_time: int
    noise: slice
    rule: slice
    geometry: slice
    imu: slice
    foot_load: slice
    links: slice


_CONSTANTS: Final = SensingLayout(
    **places(
        trust_ramp=1,
        least_force=1,
        load_time=1,
        tilt_time=1,
        noise=N_NOISE,
        rule=N_CONTACT_RULE,
        geometry=N_GEOMETRY,
        imu=3,
        foot_load=N_FOOT_LOAD_RULE,
        links=N_LINKS * LINK_SIZE,
    )
)


_MASS: Final = _CONSTANTS.geometry.start + Geometry._fields.index("mass")


def sensing_constants(config: Config, links: Array) -> Array:
    """What `sense` needs of the configuration and its robot, see `SensingLayout`.

    Args:
        config: of the team.
        links: `link_table` of the bare robot.
    """
    estimator, robot = config.estimator, config.robot
    ahead = [
        estimator.trust_ramp,
        estimator.contact_force,
        config.controller.load_time,
        estimator.tilt_time,
    ]
    return np.concatenate(
        [
            ahead,
            filter_noise(estimator),
            contact_rule(config),
            robot.geometry,
            robot.imu,
            foot_load_rule(config),
            links.ravel(),
        ]
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
    imu_error = memory0[MEMORY.imu_error].copy()
    measured = without_imu_error(readings_of(state), imu_error[:3])
    geometry = Geometry(*numbers(constants[_CONSTANTS.geometry], N_GEOMETRY))
    body = FilterBody(geometry, constants[_CONSTANTS.imu])
    loads = memory0[MEMORY.foot_load].copy()
    load = update_foot_load(
        loads,
        _leg_motion(measured, body.imu),
        measured.foot_force,
        rotation_matrix(measured.quat_wxyz),
        constants[_CONSTANTS.links].reshape(N_LINKS, LINK_SIZE),
        geometry,
        FootLoadRule(*numbers(constants[_CONSTANTS.foot_load], N_FOOT_LOAD_RULE)),
        dt,
    )
    trust = foot_trust(
        schedule[SCHEDULE.stance],
        schedule[SCHEDULE.progress],
        load.force,
        constants[_CONSTANTS.trust_ramp],
        constants[_CONSTANTS.least_force],
    )
    noise = FilterNoise(*numbers(constants[_CONSTANTS.noise], N_NOISE))
    before = filter_state_of(memory0)
    filtered, estimate, correction = filter_step(before, measured, load, trust, noise, body, dt)
    place(memory0, filtered, estimate, schedule, dt, constants, memory, sensed)
    memory[MEMORY.foot_load] = loads
    update_imu_error(imu_error, correction, estimate.R, constants[_CONSTANTS.tilt_time], dt)
    memory[MEMORY.imu_error] = imu_error


@compiled
def _leg_motion(measured: Readings, imu: Array) -> LegMotion:
    """What the legs do by the sensors."""
    return LegMotion(
        measured.q_joint,
        measured.v_joint,
        measured.tau_joint,
        measured.gyro,
        specific_force_at_origin(measured.accel, measured.gyro, imu),
    )


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
    """Fill `memory` and `sensed` from a known estimate.

    `filtered` is the filter's new memory. That of foot loads begins anew, as after a gap in what is
    measured; the error of the IMU stays.
    """
    ground_height0 = memory0[MEMORY.ground_height]
    switched = schedule[SCHEDULE.half_cycle] != memory0[MEMORY.half_cycle]
    _fill(sensed, estimate, ground_height0, switched)

    memory[:] = memory0
    memory[MEMORY.half_cycle] = schedule[SCHEDULE.half_cycle]
    memory[MEMORY.foot_load] = 0.0
    new = filter_state_of(memory)
    new.mean[:], new.covariance[:] = filtered
    memory[MEMORY.ground_height] = update_contacts(
        feet_memory_of(memory),
        ground_height0,
        phase_of(schedule, switched),
        estimate.foot_load.loaded,
        estimate.p_foot[:, 2],
        ContactRule(*numbers(constants[_CONSTANTS.rule], N_CONTACT_RULE)),
        dt,
    )
    load_time = constants[_CONSTANTS.load_time]
    if load_time > 0.0:
        rate = dt / (load_time + dt)
        memory[MEMORY.load] = estimate_load(
            memory0[MEMORY.load], estimate.foot_load.force, constants[_MASS], rate
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
    sensed[SENSED.foot_load] = estimate.foot_load.force
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
