"""The second half of a tick, compiled: from what is sensed and asked to torques."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.acting_constants import unpack_constants
from quadriga.agents.controller.foot_load import FOOT_LOAD
from quadriga.agents.controller.foot_targets import (
    desired_accelerations,
    desired_forces,
    foot_velocities,
    update_anchors,
)
from quadriga.agents.controller.friction import update_mu_reduction
from quadriga.agents.controller.maths.rigid_body import rigid_body_terms
from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.agents.controller.memory import MEMORY
from quadriga.agents.controller.payload_estimate import add_load
from quadriga.agents.controller.schedule import phase_of
from quadriga.agents.controller.sensed import (
    SENSED,
    FeetState,
    TrunkState,
    coordinates_of,
    feet_of,
    trunk_of,
)
from quadriga.agents.controller.standing_heading import keep_heading
from quadriga.agents.controller.swing import MotionReference
from quadriga.agents.controller.torque_bounds import torque_bounds
from quadriga.agents.controller.trunk_feedback import (
    Integrators,
    SingleRigidBody,
    TrunkGains,
    TrunkReference,
    fall_freely,
    feedback,
    feedforward,
)
from quadriga.agents.controller.whole_body.problem import Goal, with_mu
from quadriga.agents.controller.whole_body.solution import solve_closed_form
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, Array
from quadriga.shared.runtime.jit import compiled


class TaskLayout(NamedTuple):
    """Where the row of a `Task` keeps what.

    Attributes:
        deviation, v, wz, height, feedforward: see `Task`.
        dt: time since the last tick, s.
        new_sample: 1 if a sample of forces begins with this tick, else 0.
        tilt: see `Task`.
    """

    deviation: slice
    v: slice
    wz: int
    height: int
    feedforward: int
    dt: int
    new_sample: int
    tilt: slice


TASK: Final = TaskLayout(
    **places(deviation=N_FORCES, v=2, wz=1, height=1, feedforward=1, dt=1, new_sample=1, tilt=2)
)
TASK_SIZE: Final = row_size(TASK)


class GoalLayout(NamedTuple):
    """Where the row of a `Goal` keeps what, see there; its contacts are in the memory."""

    trunk: slice
    swing: slice
    force: slice


_GOAL: Final = GoalLayout(**places(trunk=6, swing=N_LEGS * 3, force=N_FORCES))
GOAL_SIZE: Final = row_size(_GOAL)


def goal_of(row: Array, contact: Array) -> Goal:
    """The goal of its row."""
    return Goal(
        contact, row[_GOAL.trunk], row[_GOAL.swing].reshape(4, 3), row[_GOAL.force].reshape(4, 3)
    )


@compiled
def act(
    memory0: Array,
    sensed: Array,
    schedule: Array,
    task: Array,
    constants: Array,
    memory: Array,
    goal_row: Array,
    limited: Array,
) -> bool:
    """Ask the whole-body QP for torques and solve it where no limit is active.

    Args:
        memory0: `Memory.flat` after `sense`.
        sensed: `Sensed.flat`.
        schedule: `Schedule.row`.
        task: see `TaskLayout`.
        constants: `acting_constants`.
        memory: the new `Memory.flat`, filled.
        goal_row: see `GoalLayout`, filled.
        limited: see `solve_closed_form`, filled.

    Returns:
        Whether no limit is active.
    """
    memory[:] = memory0
    load, dt = memory0[MEMORY.load], task[TASK.dt]
    fixed, phase = unpack_constants(constants), phase_of(schedule, sensed[SENSED.switched] > 0.5)
    trunk, p_foot, contact = trunk_of(sensed), feet_of(sensed), memory[MEMORY.contact]
    q, v = coordinates_of(sensed)
    terms = rigid_body_terms(q, v, add_load(fixed.links, load))
    body = SingleRigidBody(fixed.body.mass + load, fixed.body.com, fixed.body.inertia_inverse)

    deviation = accumulate_forces(
        memory, task[TASK.deviation], phase.stance, task[TASK.new_sample] > 0.5, fixed.weight
    )
    push, v_des = _track_reference(memory, trunk, p_foot, task, fixed.trunk, dt)
    if task[TASK.feedforward] > 0.5:
        push += feedforward(deviation, phase.stance, trunk, p_foot, body)
    if fixed.free_fall:
        fall_freely(push, contact)

    ground_force = memory0[MEMORY.foot_load][FOOT_LOAD.force].reshape(4, 3)
    v_foot = foot_velocities(terms.J, v, p_foot)
    feet = FeetState(p_foot, v_foot, sensed[SENSED.foot_load], ground_force)
    memory[MEMORY.mu_reduction] = update_mu_reduction(
        memory0[MEMORY.mu_reduction], contact, phase, feet, fixed.friction, dt
    )
    inwards = body.mass / fixed.body.mass * fixed.feet.foothold_inwards
    motion = MotionReference(trunk.velocity, v_des, task[TASK.wz], inwards)
    update_anchors(memory, phase, trunk, p_foot, fixed.feet, dt)
    swing = desired_accelerations(memory, phase, trunk, feet, motion, fixed.feet)
    goal = Goal(contact, push, swing, desired_forces(contact, deviation, trunk.R, body.mass))
    _note_goal(goal, goal_row)

    weights = with_mu(fixed.weights, fixed.weights.mu - memory[MEMORY.mu_reduction])
    bounds = torque_bounds(sensed[SENSED.v_joint], fixed.motors)
    return solve_closed_form(terms, trunk.R, p_foot, goal, weights, bounds, limited)


@compiled
def accumulate_forces(
    memory: Array, planned: Array, stance: Array, new_sample: bool, weight: float
) -> Array:
    """Add the planned forces to their sum over the present sample.

    Args:
        memory: `Memory.flat`; `force_sum` and `force_count` change.
        planned: deviation from the nominal forces, (12,), N, yaw frame.
        stance: scheduled stance, (4,), 1 or 0.
        new_sample: whether a sample begins with this tick.
        weight: of the robot alone, N.

    Returns:
        The deviation of the legs scheduled to stand, (12,), N, yaw frame.
    """
    total = memory[MEMORY.force_sum]
    if new_sample:
        total[:] = 0.0
        memory[MEMORY.force_count] = 0.0
    memory[MEMORY.force_count] += 1.0
    share = weight / max(1.0, np.sum(stance))
    deviation = np.zeros(12)
    for i in range(12):
        deviation[i] = planned[i] * stance[i // 3]
        nominal = share * stance[i // 3] if i % 3 == 2 else 0.0
        total[i] += nominal + deviation[i]
    return deviation


@compiled
def _track_reference(
    memory: Array, trunk: TrunkState, p_foot: Array, task: Array, gains: TrunkGains, dt: float
) -> tuple[Array, Array]:
    """The trunk's acceleration by feedback, (6,), and its desired velocity, (3,), odometry frame.

    The integrators in `memory` go on.
    """
    stands = memory[MEMORY.half_cycle] < 0.0 and np.sum(memory[MEMORY.contact]) == N_LEGS
    keep_heading(memory, stands, p_foot, dt)
    before = Integrators(
        memory[MEMORY.height_integral],
        memory[MEMORY.speed_integral],
        memory[MEMORY.position_error],
        memory[MEMORY.yaw_des],
    )
    height = memory[MEMORY.ground_height] + task[TASK.height]
    reference = TrunkReference(task[TASK.v], task[TASK.wz], height, task[TASK.tilt])
    after, push, v_des = feedback(before, gains, trunk, reference, dt)
    memory[MEMORY.height_integral], memory[MEMORY.yaw_des] = after.height, after.yaw
    memory[MEMORY.speed_integral] = after.speed
    memory[MEMORY.position_error] = after.position_error
    return push, v_des


@compiled
def _note_goal(goal: Goal, row: Array) -> None:
    """Fill a goal's row."""
    for k in range(6):
        row[_GOAL.trunk.start + k] = goal.trunk[k]
    for leg in range(4):
        for axis in range(3):
            k = 3 * leg + axis
            row[_GOAL.swing.start + k] = goal.swing[leg, axis]
            row[_GOAL.force.start + k] = goal.force[leg, axis]
