"""The 1 kHz controller of one robot: contacts, references, whole-body QP, motor command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controller import swing, whole_body_qp
from agents.controller.contact import ContactState, initial_contact, step_contact
from agents.controller.estimator import Estimate
from agents.controller.model import RigidBody
from agents.controller.references import (
    Integrators,
    initial_integrators,
    trunk_acceleration,
    trunk_gains,
)
from agents.controller.whole_body_qp import Goal, Solution, Weights
from shared.config import Config
from shared.jit import compiled
from shared.robot import Array


@dataclass(frozen=True, slots=True)
class ControllerState:
    """What the controller remembers from tick to tick.

    Attributes:
        contact: contacts and ground heights.
        integrators: of height, speed, heading.
        swing_start: where each foot left the ground, (4, 3), m, odometry frame.
        foot_goal: where a foot that lost contact is being lowered to, (4, 3), m.
    """

    contact: ContactState
    integrators: Integrators
    swing_start: Array
    foot_goal: Array


@dataclass(frozen=True, slots=True)
class Schedule:
    """The gait at one tick: scheduled stance (4,), progress of the half period, its number."""

    stance: Array
    progress: float
    half: int


@dataclass(frozen=True, slots=True)
class Task:
    """What the robot is asked to do at one tick (yaw frame).

    Attributes:
        velocity: vx, vy, (2,), m/s.
        wz: yaw rate, rad/s.
        height: trunk height above the ground, m.
        deviation: planned deviation from the nominal forces, (12,), N.
        feedforward: whether the deviation also becomes accelerations of the trunk.
    """

    velocity: Array
    wz: float
    height: float
    deviation: Array
    feedforward: bool


class Controller:
    """Fixed data of one robot's controller; `step` is a function of state and inputs alone."""

    def __init__(self, config: Config) -> None:
        self._config = config.controller
        self._gains = trunk_gains(config.controller)
        self.body = RigidBody()
        controller = config.controller
        self._feet_constants = np.array(
            [
                1e-3 * config.gait.stance_ms, controller.raibert_gain, controller.swing_height,
                controller.descent_speed, controller.kp_swing, controller.kd_swing, self.body.mass,
            ]
        )  # fmt: skip
        self.weights = Weights(
            config.controller.gamma_tau,
            config.controller.gamma_force,
            config.controller.gamma_defect,
            config.controller.mu,
            config.controller.force_min,
        )

    def initial(self, estimate: Estimate, yaw: float) -> ControllerState:
        """Stand where the robot stands."""
        return ControllerState(
            initial_contact(), initial_integrators(yaw), estimate.p_foot, estimate.p_foot
        )

    def step(
        self, state: ControllerState, estimate: Estimate, quat_wxyz: Array, schedule: Schedule,
        task: Task, dt: float,
    ) -> tuple[ControllerState, Solution]:  # fmt: skip
        """One tick: returns the new state and the QP's solution."""
        switched = schedule.half != state.contact.half
        contact = step_contact(
            state.contact, self._config, schedule.stance, schedule.progress, schedule.half,
            estimate.foot_force, estimate.p_foot[:, 2], dt,
        )  # fmt: skip
        terms = self.body.terms(estimate, quat_wxyz)
        integrators, trunk, v_des = trunk_acceleration(
            state.integrators, self._gains, self.body, estimate, task, contact.level,
            schedule.stance, dt,
        )  # fmt: skip
        swing_start, foot_goal, feet, force = _feet(
            state.swing_start, state.foot_goal, contact.contact, schedule.stance,
            schedule.progress, switched, contact.ground, estimate.position, estimate.velocity,
            estimate.R, estimate.p_foot, terms.J, terms.v, v_des, task.wz, task.deviation, dt,
            self._feet_constants,
        )  # fmt: skip
        goal = Goal(contact.contact, trunk, feet, force)
        solution = whole_body_qp.solve_goal(
            terms, estimate.R, estimate.p_foot, goal, self.weights
        )  # fmt: skip
        return ControllerState(contact, integrators, swing_start, foot_goal), solution


@compiled
def _feet(
    swing_start0: Array, foot_goal0: Array, contact: Array, stance: Array, progress: float,
    switched: bool, ground: Array, position: Array, velocity: Array, R: Array, p_foot: Array,
    J: Array, v: Array, v_des: Array, wz: float, deviation: Array, dt: float, constants: Array,
) -> Array:  # fmt: skip
    """New swing starts and foot goals, desired accelerations and forces, rows of (4, 4, 3)."""
    duration, raibert_gain, height, descent_speed, kp, kd, mass = constants
    swing_start, foot_goal = _feet_anchors(
        swing_start0, foot_goal0, p_foot, contact, stance, switched, descent_speed * dt
    )
    out = np.empty((4, 4, 3))
    out[0], out[1] = swing_start, foot_goal
    out[2] = _feet_acceleration(
        contact, stance, progress, swing_start, foot_goal, ground, position, velocity, R, p_foot,
        _foot_velocities(J, v, p_foot), v_des, wz, duration, raibert_gain, height, descent_speed,
        kp, kd,
    )  # fmt: skip
    out[3] = _desired_force(contact, deviation, R, mass)
    return out


@compiled
def _feet_anchors(
    swing_start: Array, foot_goal: Array, p_foot: Array, contact: Array, stance: Array,
    switched: bool, descent: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Where swings begin and where unloaded stance feet are being lowered to, (4, 3) each."""
    start, goal = swing_start.copy(), foot_goal.copy()
    for leg in range(4):
        if switched and stance[leg] < 0.5:
            start[leg] = p_foot[leg]
        if contact[leg] > 0.5:
            goal[leg] = p_foot[leg]
        elif stance[leg] > 0.5:
            goal[leg, 2] -= descent
    return start, goal


@compiled
def _desired_force(contact: Array, deviation: Array, R: Array, mass: float) -> Array:
    """Nominal weight on the feet in contact plus the planned deviation, (4, 3), N."""
    count = max(1.0, np.sum(contact))
    norm = np.sqrt(R[0, 0] ** 2 + R[1, 0] ** 2)
    c, s = R[0, 0] / norm, R[1, 0] / norm
    force = np.zeros((4, 3))
    for leg in range(4):
        if contact[leg] > 0.5:
            dx, dy, dz = deviation[3 * leg], deviation[3 * leg + 1], deviation[3 * leg + 2]
            force[leg, 0] = c * dx - s * dy
            force[leg, 1] = s * dx + c * dy
            force[leg, 2] = mass * 9.81 / count + dz
    return force


@compiled
def _foot_velocities(J: Array, v: Array, p_foot: Array) -> Array:
    """Velocities of the foot centres, (4, 3), m/s, odometry frame."""
    out = np.empty((4, 3))
    for leg in range(4):
        twist = np.zeros(6)
        for k in range(9):
            column = k if k < 6 else 3 * leg + k
            for row in range(6):
                twist[row] += J[row, column] * v[column]
        p = p_foot[leg]
        out[leg, 0] = twist[0] + twist[4] * p[2] - twist[5] * p[1]
        out[leg, 1] = twist[1] + twist[5] * p[0] - twist[3] * p[2]
        out[leg, 2] = twist[2] + twist[3] * p[1] - twist[4] * p[0]
    return out


@compiled
def _feet_acceleration(
    contact: Array, stance: Array, progress: float, swing_start: Array, foot_goal: Array,
    ground: Array, position: Array, velocity: Array, R: Array, p_foot: Array, v_foot: Array,
    v_des: Array, wz: float, duration: float, raibert_gain: float, height: float,
    descent_speed: float, kp: float, kd: float,
) -> Array:  # fmt: skip
    """Desired accelerations of the feet not in contact, (4, 3), m/s²."""
    out = np.zeros((4, 3))
    expected = 0.0  # the ground at the foothold: what the feet now standing feel
    count = 0.0
    for leg in range(4):
        if stance[leg] > 0.5:
            expected += ground[leg]
            count += 1.0
    expected = expected / max(1.0, count)
    highest = np.max(ground)
    for leg in range(4):
        if contact[leg] > 0.5:
            continue
        reference = np.zeros((3, 3))
        if stance[leg] > 0.5:
            reference[0] = foot_goal[leg]
            reference[1, 2] = -descent_speed
        else:
            target = swing.foothold(
                leg, position, velocity, R, v_des, wz, (1.0 - progress) * duration, duration,
                raibert_gain,
            )  # fmt: skip
            reference = swing.swing_reference(
                swing_start[leg], target, expected, highest + height, progress, duration
            )
        out[leg] = (
            reference[2] + kp * (reference[0] - p_foot[leg]) + kd * (reference[1] - v_foot[leg])
        )
    return out
