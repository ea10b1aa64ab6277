"""The parts of a tick one by one, with named results: what `Controller` calls in one piece."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quadriga.agents.controller.contact import contact_rule, update_contacts
from quadriga.agents.controller.controller import Task
from quadriga.agents.controller.estimator import Estimate, FilterNoise, filter_step
from quadriga.agents.controller.foot_load import FootLoad, foot_load_rule
from quadriga.agents.controller.imu_error import update_imu_error, without_imu_error
from quadriga.agents.controller.memory import (
    FeetMemory,
    FilterState,
    feet_memory_of,
    initial_memory,
)
from quadriga.agents.controller.model import RigidBody
from quadriga.agents.controller.readings import readings_of
from quadriga.agents.controller.schedule import Schedule, phase_of
from quadriga.agents.controller.sensed import TrunkState
from quadriga.agents.controller.trunk_feedback import (
    Integrators,
    SingleRigidBody,
    TrunkGains,
    TrunkReference,
    feedback,
    feedforward,
)
from quadriga.shared.config.sections import Config, ControllerConfig
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import Array
from tests.a1 import BODY

RULE = foot_load_rule(Config())


def estimate_trunk(
    previous: FilterState,
    state: State,
    trust: Array,
    noise: FilterNoise,
    dt: float,
    imu_error: Array | None = None,
) -> tuple[FilterState, Estimate]:
    """One step of the estimator of a robot whose foot sensors measure N.

    With `imu_error`, (4,), that is estimated on the way, too, and changed in place.
    """
    error = np.zeros(4) if imu_error is None else imu_error
    readings = without_imu_error(readings_of(state.row), error[:3])
    force = readings.foot_force
    load = FootLoad(force, force >= RULE.least_force)
    filtered, estimate, correction = filter_step(previous, readings, load, trust, noise, BODY, dt)
    update_imu_error(error, correction, estimate.R, 0.0 if imu_error is None else 5.0, dt)
    return filtered, estimate


@dataclass(frozen=True)
class ContactState:
    """What is remembered of the feet, the ground's height and the half cycle, see `Memory`."""

    feet: FeetMemory
    ground_height: float
    half_cycle: int


def initial_contact() -> ContactState:
    """All four feet on flat ground at height zero."""
    return ContactState(feet_memory_of(initial_memory()), 0.0, -1)


def step_contact(
    previous: ContactState,
    config: ControllerConfig,
    schedule: Schedule,
    foot_force: Array,
    foot_z: Array,
    dt: float,
) -> ContactState:
    """One step of the contact detection; reactions stay as they are."""
    feet = FeetMemory(*(part.copy() for part in previous.feet))
    ground_height = update_contacts(
        feet,
        previous.ground_height,
        phase_of(schedule.row, schedule.half_cycle != previous.half_cycle),
        foot_force >= config.contact_force,
        foot_z,
        contact_rule(replace(Config(), controller=config)),
        dt,
    )
    return ContactState(feet, ground_height, schedule.half_cycle)


def initial_integrators(yaw: float) -> Integrators:
    """All at rest, heading kept."""
    return Integrators(0.0, np.zeros(2), np.zeros(2), yaw)


def trunk_at(estimate: Estimate) -> TrunkState:
    """Where the trunk is and how it moves."""
    return TrunkState(estimate.position, estimate.velocity, estimate.R, estimate.omega)


def rigid(body: RigidBody) -> SingleRigidBody:
    """A robot that carries nothing."""
    return SingleRigidBody(body.mass, body.com, body.inertia_inverse)


def trunk_acceleration(
    previous: Integrators,
    gains: TrunkGains,
    body: RigidBody,
    estimate: Estimate,
    task: Task,
    ground_height: float,
    stance: Array,
    dt: float,
) -> tuple[Integrators, Array, Array]:
    """One step of the trunk's references."""
    trunk = trunk_at(estimate)
    reference = TrunkReference(
        np.array([task.vx, task.vy]),
        task.wz,
        ground_height + task.height,
        np.array([task.roll, task.pitch]),
    )
    after, push, v_des = feedback(previous, gains, trunk, reference, dt)
    if task.feedforward:
        push += feedforward(task.deviation, stance, trunk, estimate.p_foot, rigid(body))
    return after, push, v_des
