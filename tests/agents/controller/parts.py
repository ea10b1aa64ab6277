"""The parts of a tick one by one, with named results: what `Controller` calls in one piece."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from quadriga.agents.controller.contact import ContactRule, contacts_by_force, contacts_by_schedule
from quadriga.agents.controller.controller import Task
from quadriga.agents.controller.estimator import Estimate, filter_step, mean_at, standing_mean, sure
from quadriga.agents.controller.memory import Swings
from quadriga.agents.controller.model import RigidBody
from quadriga.agents.controller.sensing import Trunk
from quadriga.agents.controller.trunk_feedback import (
    Asked,
    Integrators,
    SingleRigidBody,
    feedback,
    feedforward,
)
from quadriga.shared.config.sections import ControllerConfig
from quadriga.shared.robot.a1 import Array
from quadriga.shared.wire.messages import State


@dataclass(frozen=True)
class FilterState:
    """Mean (6, 3) and covariance (6, 6) of the estimator."""

    mean: Array
    covariance: Array


def initial_filter(state: State) -> FilterState:
    """Of a robot that stands still."""
    return FilterState(standing_mean(state), sure())


def filter_at(estimate: Estimate) -> FilterState:
    """That takes an estimate for right."""
    return FilterState(mean_at(estimate), sure())


def estimate_trunk(
    previous: FilterState, state: State, trust: Array, noise: Array, dt: float
) -> tuple[FilterState, Estimate]:
    """One step of the estimator."""
    mean, covariance, frame = filter_step(
        previous.mean,
        previous.covariance,
        state.imu_quat_wxyz,
        state.imu_gyro,
        state.imu_accel,
        state.q_joint,
        state.v_joint,
        trust,
        noise,
        dt,
    )
    estimate = Estimate(
        mean[0],
        mean[1],
        frame[:3],
        state.imu_gyro,
        frame[3:],
        state.q_joint,
        state.v_joint,
        state.foot_force,
    )
    return FilterState(mean, covariance), estimate


@dataclass(frozen=True)
class ContactState:
    """Contacts: see `Memory`."""

    contact: Array
    early: Array
    unloaded: Array
    latched: Array
    ground: Array
    level: float
    half: int
    lift: Array = field(default_factory=lambda: np.zeros(4))
    stumble: Array = field(default_factory=lambda: np.zeros(4))
    felt: Array = field(default_factory=lambda: np.zeros((4, 3)))


def initial_contact() -> ContactState:
    """All four feet on flat ground at height zero."""
    return ContactState(np.ones(4), np.zeros(4), np.zeros(4), np.ones(4), np.zeros(4), 0.0, -1)


def step_contact(
    previous: ContactState,
    config: ControllerConfig,
    stance: Array,
    progress: float,
    half: int,
    foot_force: Array,
    foot_z: Array,
    dt: float,
    stance_time: float = 0.2,
) -> ContactState:
    """One step of the contact detection; what the feet feel stays as it is."""
    p, rate = previous, dt / (1e-3 * config.ground_filter_ms + dt)
    before = np.array([p.contact, p.early, p.unloaded, p.latched, p.ground])
    lift, stumble = p.lift.copy(), p.stumble.copy()
    if config.contact_detection:
        rule = ContactRule(
            config.contact_force,
            1e-3 * config.lost_contact_ms,
            1e-3 * config.liftoff_hold_ms / stance_time,
            1e-3 * config.reflex_ms,
            config.reject_side_contacts,
        )
        legs, level = contacts_by_force(
            before,
            p.level,
            half != p.half,
            stance,
            progress,
            foot_force,
            foot_z,
            Swings(lift, stumble, p.felt),
            rule,
            rate,
            dt,
        )
    else:
        legs, level = contacts_by_schedule(p.ground, p.level, stance, foot_z, rate)
    contact, early, unloaded, latched, ground = legs
    return ContactState(
        contact, early, unloaded, latched, ground, level, half, lift, stumble, p.felt
    )


def initial_integrators(yaw: float) -> Integrators:
    """All at rest, heading kept."""
    return Integrators(0.0, np.zeros(2), np.zeros(2), yaw)


def trunk_at(estimate: Estimate) -> Trunk:
    """Where the trunk is and how it moves."""
    return Trunk(estimate.position, estimate.velocity, estimate.R, estimate.omega)


def rigid(body: RigidBody) -> SingleRigidBody:
    """A robot that carries nothing."""
    return SingleRigidBody(body.mass, body.com, body.inertia_inverse)


def trunk_acceleration(
    previous: Integrators,
    gains: Array,
    body: RigidBody,
    estimate: Estimate,
    task: Task,
    level: float,
    stance: Array,
    dt: float,
) -> tuple[Integrators, Array, Array]:
    """One step of the trunk's references."""
    trunk = trunk_at(estimate)
    asked = Asked(np.array([task.vx, task.vy]), task.wz, level + task.height)
    after, push, v_des = feedback(previous, gains, trunk, asked, dt)
    if task.feedforward:
        push += feedforward(task.deviation, stance, trunk, estimate.p_foot, rigid(body))
    return after, push, v_des
