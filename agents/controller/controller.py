"""The 1 kHz controller of one robot: contacts, references, whole-body QP, motor command.

A tick is two compiled calls. Between two ticks the processor's caches are lost, so that a tick
costs what it goes through: flat arrays, few objects. All arithmetic is in the functions that these
calls are made of.
"""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np

from quadriga.agents.controller import whole_body_qp
from quadriga.agents.controller.estimator import Estimate, mean_at, standing_mean, sure
from quadriga.agents.controller.foot_targets import feet_constants, feet_demand, foot_velocities
from quadriga.agents.controller.friction import FrictionRule, caution
from quadriga.agents.controller.maths.rigid_body import rigid_body_terms
from quadriga.agents.controller.maths.rotation import from_yaw_frame, roll_pitch_yaw
from quadriga.agents.controller.memory import (
    CAUTION,
    COUNT,
    HEIGHT,
    LEVEL,
    LOAD,
    SIZE,
    YAW,
    Memory,
    anchors_of,
    blank,
    filter_of,
    forces_of,
    legs_of,
    speed_of,
)
from quadriga.agents.controller.model import RigidBody
from quadriga.agents.controller.payload_estimate import loaded
from quadriga.agents.controller.sensing import (
    SEEN_SIZE,
    Sensed,
    coordinates_of,
    feet_of,
    foot_force_of,
    place,
    sense,
    sensing_constants,
    trunk_of,
)
from quadriga.agents.controller.trunk_feedback import (
    Asked,
    Integrators,
    SingleRigidBody,
    fall_freely,
    feedback,
    feedforward,
    trunk_gains,
)
from quadriga.agents.controller.whole_body_qp import (
    MU,
    Goal,
    Weights,
    WholeBodyProblem,
    WholeBodySolution,
    closed_form,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import GRAVITY, TOTAL_MASS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.messages import State


@record
class Schedule:
    """The gait at one tick: scheduled stance (4,), progress of the half period, its number."""

    stance: Array
    progress: float
    half: int
    row: Array = field(init=False, repr=False, compare=False)  # all of it, for compiled code

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", np.array([*self.stance, self.progress, self.half]))


@record
class Task:
    """What the robot is asked to do at one tick (yaw frame).

    Attributes:
        vx: forward speed, m/s.
        vy: speed to the left, m/s.
        wz: yaw rate, rad/s.
        height: trunk height above the ground, m.
        deviation: planned deviation from the nominal forces, (12,), N; that of legs scheduled to
            swing is not applied.
        feedforward: whether the deviation also becomes accelerations of the trunk.
        ahead: velocity with which footholds count, (2,), m/s; None: the one of now.
    """

    vx: float
    vy: float
    wz: float
    height: float
    deviation: Array
    feedforward: bool
    ahead: Array | None = None


@record
class ControllerOutputs:
    """What a tick comes to: the new memory, what the QP was asked for and its answer."""

    memory: Memory
    asked: Array
    solution: WholeBodySolution

    @property
    def goal(self) -> Goal:
        """What the QP was asked for."""
        return _goal(self.asked, self.memory.contact)


class Controller:
    """Fixed data of one robot's controller; its functions depend on their arguments alone."""

    def __init__(self, config: Config) -> None:
        controller = config.controller
        self.body = RigidBody()
        self._sensing = sensing_constants(config)
        self.weights = Weights(
            controller.gamma_tau,
            controller.gamma_force,
            controller.gamma_defect,
            controller.mu,
            controller.force_min,
            controller.tilt_length,
            controller.swing_weight,
        )
        self._acting = np.concatenate(
            [
                trunk_gains(controller),
                feet_constants(config),
                self.body.com,
                self.body.inertia_inverse.ravel(),
                self.weights.as_array(),
                [
                    self.body.mass,
                    float(controller.flight),
                    controller.slip_speed,
                    controller.slip_load,
                    controller.mu_min,
                    controller.mu_recovery,
                ],
            ]
        )

    def sense(self, memory: Memory | None, state: State, schedule: Schedule, dt: float) -> Sensed:
        """Where the robot is and on which feet it stands, by its own sensors.

        Args:
            memory: of the last tick; None: it stands still at the origin.
            state: what it measures.
            schedule: the gait.
            dt: time since the last tick, s.
        """
        before = blank() if memory is None else memory.flat
        if memory is None:
            mean, covariance = filter_of(before)
            mean[:], covariance[:] = standing_mean(state), sure()
        new, seen = np.empty(SIZE), np.empty(SEEN_SIZE)
        sense(before, state.row, schedule.row, dt, self._sensing, new, seen)
        return _begun(new, seen) if memory is None else Sensed(Memory(new), seen)

    def place(
        self,
        memory: Memory | None,
        estimate: Estimate,
        quat_wxyz: Array,
        schedule: Schedule,
        dt: float,
    ) -> Sensed:
        """The same for a robot that knows where it is; its filter goes on from there."""
        before = blank() if memory is None else memory.flat
        new, seen = np.empty(SIZE), np.empty(SEEN_SIZE)
        place(
            before,
            mean_at(estimate),
            sure(),
            quat_wxyz,
            estimate.R,
            estimate.omega,
            estimate.p_foot,
            estimate.q_joint,
            estimate.v_joint,
            estimate.foot_force,
            schedule.row,
            dt,
            self._sensing,
            new,
            seen,
        )
        return _begun(new, seen) if memory is None else Sensed(Memory(new), seen)

    def act(
        self, seen: Sensed, schedule: Schedule, task: Task, dt: float, *, new_sample: bool = False
    ) -> ControllerOutputs:
        """Torques for what the robot is asked to do.

        Where no limit of the QP is active, as at most ticks, this is one compiled call; a singular
        problem, whose numbers are NaN, is no solution.

        Args:
            seen: what `sense` gave for this tick.
            schedule: the gait.
            task: what is asked.
            dt: time since the last tick, s.
            new_sample: whether a sample of forces begins with this tick.
        """
        new, asked, x = np.empty(SIZE), np.empty(_ASKED), np.zeros(42)
        rows = _act(
            seen.memory.flat,
            seen.flat,
            schedule.row,
            task.vx,
            task.vy,
            task.wz,
            task.height,
            task.deviation,
            task.feedforward,
            _NOW if task.ahead is None else task.ahead,
            dt,
            new_sample,
            self.body.links,
            self._acting,
            new,
            asked,
            x,
        )
        if rows:
            return ControllerOutputs(
                Memory(new), asked, WholeBodySolution(x, whole_body_qp.UNCONSTRAINED, rows)
            )
        goal = _goal(asked, legs_of(new)[0])
        problem = self.problem(seen, Memory(new), goal)
        solution = whole_body_qp.unpack(problem, goal.contact, *whole_body_qp.solve(problem))
        return ControllerOutputs(Memory(new), asked, solution)

    def problem(self, seen: Sensed, memory: Memory, goal: Goal) -> WholeBodyProblem:
        """The QP of a tick.

        Args:
            seen: what `sense` gave for it.
            memory: after it.
            goal: what was asked for.
        """
        terms = self.body.terms(seen.flat[0:19], seen.flat[19:37], memory.load)
        weights = replace(self.weights, mu=self.weights.mu - memory.caution)
        return whole_body_qp.build(terms, seen.R, seen.p_foot, goal, weights)


_NOW = np.full(2, np.nan)  # footholds count on the velocity of now
_ASKED = 30  # desired acceleration of the trunk (6), of the feet (12), desired forces (12)


def _goal(asked: Array, contact: Array) -> Goal:
    return Goal(contact, asked[:6], asked[6:18].reshape(4, 3), asked[18:].reshape(4, 3))


def _begun(flat: Array, seen: Array) -> Sensed:
    """The first tick: feet are anchored where they are, the heading is kept."""
    start, goal = anchors_of(flat)
    start[:] = goal[:] = feet_of(seen)
    flat[YAW] = roll_pitch_yaw(trunk_of(seen).R)[2]
    return Sensed(Memory(flat), seen)


@compiled
def note_forces(memory: Array, planned: Array, stance: Array, new_sample: bool) -> Array:
    """The deviation of the legs scheduled to stand, (12,); counts the planned forces with it."""
    total = forces_of(memory)
    if new_sample:
        total[:] = 0.0
        memory[COUNT] = 0.0
    memory[COUNT] += 1.0
    weight = TOTAL_MASS * GRAVITY / max(1.0, np.sum(stance))
    deviation = np.zeros(12)
    for i in range(12):
        deviation[i] = planned[i] * stance[i // 3]
        nominal = weight * stance[i // 3] if i % 3 == 2 else 0.0
        total[i] += nominal + deviation[i]
    return deviation


@compiled
def _act(
    memory0: Array,
    seen: Array,
    schedule: Array,
    vx: float,
    vy: float,
    wz: float,
    height: float,
    planned: Array,
    feeds_forward: bool,
    ahead: Array,
    dt: float,
    new_sample: bool,
    links: Array,
    constants: Array,
    memory: Array,
    asked: Array,
    x: Array,
) -> int:
    """Fill the new memory, what is asked and the answer `closed_form` gives, with its result."""
    gains, feet, com = constants[0:12], constants[12:22], constants[22:25]
    inertia_inverse, weights = constants[25:34].reshape(3, 3), constants[34:41].copy()
    bare_mass, flight, slip_speed, slip_load, mu_min, mu_recovery = constants[41:47]
    stance, progress = schedule[0:4], schedule[4]
    trunk, p_foot = trunk_of(seen), feet_of(seen)
    q, v = coordinates_of(seen)
    load = memory0[LOAD]
    mass = bare_mass + load
    M_inverse, nle = np.empty((18, 18)), np.empty(18)
    J, dJ = np.empty((6, 18)), np.empty((6, 18))
    rigid_body_terms(q, v, loaded(links, load), M_inverse, nle, J, dJ)
    memory[:] = memory0
    deviation = note_forces(memory, planned, stance, new_sample)
    speed, lead = speed_of(memory)
    kept, push, v_des = feedback(
        Integrators(memory0[HEIGHT], speed, lead, memory0[YAW]),
        gains,
        trunk,
        Asked(np.array([vx, vy]), wz, memory0[LEVEL] + height),
        dt,
    )
    memory[HEIGHT], speed[:], lead[:], memory[YAW] = kept
    if feeds_forward:
        body = SingleRigidBody(mass, com, inertia_inverse)
        push += feedforward(deviation, stance, trunk, p_foot, body)
    contact = legs_of(memory)[0]
    if flight > 0.5:
        fall_freely(push, contact)
    v_foot = foot_velocities(J, v, p_foot)
    rule = FrictionRule(slip_speed, slip_load, weights[MU], mu_min, mu_recovery)
    memory[CAUTION] = caution(
        memory0[CAUTION], contact, stance, progress, v_foot, foot_force_of(seen), rule, dt
    )
    weights[MU] -= memory[CAUTION]
    v_ahead = trunk.velocity if np.isnan(ahead[0]) else from_yaw_frame(ahead, trunk.R)
    swing, force = feet_demand(
        memory, seen, schedule, v_foot, v_ahead, v_des, wz, deviation, mass, dt, feet
    )
    asked[:6], asked[6:18], asked[18:] = push, swing.ravel(), force.ravel()
    return closed_form(
        M_inverse, nle, J, dJ, v, trunk.R, p_foot, contact, push, swing, force, weights, x
    )
