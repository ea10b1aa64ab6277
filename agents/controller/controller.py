"""The 1 kHz controller of one robot: contacts, references, whole-body QP, motor command.

A tick is two compiled calls, `sense` and `act`. Between two ticks the processor's caches are lost,
so that a tick costs what it goes through: flat rows, few objects. All arithmetic is in the
functions that these calls are made of.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np

from quadriga.agents.controller.acting import GOAL_SIZE, TASK, TASK_SIZE, act, goal_of
from quadriga.agents.controller.acting_constants import acting_constants
from quadriga.agents.controller.estimator import Estimate, filter_at, standing_filter
from quadriga.agents.controller.maths.rotation import roll_pitch_yaw
from quadriga.agents.controller.memory import MEMORY, MEMORY_SIZE, Memory, initial_memory
from quadriga.agents.controller.model import RigidBody
from quadriga.agents.controller.schedule import Schedule
from quadriga.agents.controller.sensed import SENSED, SENSED_SIZE, Sensed
from quadriga.agents.controller.sensing import place, sense, sensing_constants
from quadriga.agents.controller.torque_bounds import torque_bounds
from quadriga.agents.controller.whole_body.assembly import build
from quadriga.agents.controller.whole_body.limited import LIMITED_SIZE
from quadriga.agents.controller.whole_body.problem import (
    Goal,
    WholeBodyProblem,
    WholeBodySolution,
    qp_weights,
)
from quadriga.agents.controller.whole_body.solution import finish
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.torque_speed import motor_curves
from quadriga.shared.runtime.record import record

# The numbers of a task's row behind the deviation: v, wz, height, feedforward, …
_NUMBERS: Final = struct.Struct(f"={TASK_SIZE - TASK.v.start}d")
_NUMBERS_AT: Final = 8 * TASK.v.start


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


@record
class ControllerOutputs:
    """What a tick comes to.

    Attributes:
        memory: of this tick.
        goal_row: what the QP was asked for, see `GoalLayout`.
        solution: of the QP.
    """

    memory: Memory
    goal_row: Array
    solution: WholeBodySolution

    @property
    def goal(self) -> Goal:
        """What the QP was asked for."""
        return goal_of(self.goal_row, self.memory.contact)


class Controller:
    """Fixed data of one robot's controller; its functions depend on their arguments alone.

    Attributes:
        body: the robot's rigid body.
        weights: of the whole-body QP.
    """

    def __init__(self, config: Config) -> None:
        robot = config.robot
        self.body = RigidBody(robot, rotors=config.motors.rotor_inertia)
        self.weights = qp_weights(config.controller)
        self._sensing = sensing_constants(config, self.body.links)
        self._robot = robot
        self._motors = motor_curves(robot, torque_speed=config.motors.torque_speed)
        self._acting = acting_constants(config, self.body, self.weights)

    def sense(self, memory: Memory | None, state: State, schedule: Schedule, dt: float) -> Sensed:
        """Where the robot is and on which feet it stands, by its own sensors.

        Args:
            memory: of the last tick; None: it stands still at the origin.
            state: what it measures.
            schedule: the gait.
            dt: time since the last tick, s.
        """
        before = initial_memory() if memory is None else memory.flat
        if memory is None:
            mean, covariance = standing_filter(state, self._robot)
            before[MEMORY.mean], before[MEMORY.covariance] = mean.ravel(), covariance.ravel()
        new, sensed = np.empty(MEMORY_SIZE), np.empty(SENSED_SIZE)
        sense(before, state.row, schedule.row, dt, self._sensing, new, sensed)
        return _begin(new, sensed) if memory is None else Sensed(Memory(new), sensed)

    def place(
        self, memory: Memory | None, estimate: Estimate, schedule: Schedule, dt: float
    ) -> Sensed:
        """The same for a robot that knows where it is; its filter goes on from there."""
        before = initial_memory() if memory is None else memory.flat
        new, sensed = np.empty(MEMORY_SIZE), np.empty(SENSED_SIZE)
        filtered = filter_at(estimate)
        place(before, filtered, estimate, schedule.row, dt, self._sensing, new, sensed)
        return _begin(new, sensed) if memory is None else Sensed(Memory(new), sensed)

    def act(
        self, sensed: Sensed, schedule: Schedule, task: Task, dt: float, *, new_sample: bool = False
    ) -> ControllerOutputs:
        """Torques for what the robot is asked to do.

        Where no limit of the QP is active, as at most ticks, this is one compiled call; else the
        solver follows. A singular problem, whose numbers are NaN, is no solution.

        Args:
            sensed: what `sense` gave for this tick.
            schedule: the gait.
            task: what is asked.
            dt: time since the last tick, s.
            new_sample: whether a sample of forces begins with this tick.
        """
        before, constants, row = sensed.memory.flat, self._acting, _row_of(task, dt, new_sample)
        flat, goal_row, limited = np.empty(MEMORY_SIZE), np.empty(GOAL_SIZE), np.empty(LIMITED_SIZE)
        free = act(before, sensed.flat, schedule.row, row, constants, flat, goal_row, limited)
        memory = Memory(flat)
        solution = finish(free, limited, memory.contact)
        return ControllerOutputs(memory, goal_row, solution)

    def problem(self, sensed: Sensed, memory: Memory, goal: Goal) -> WholeBodyProblem:
        """The QP of a tick.

        Args:
            sensed: what `sense` gave for it.
            memory: after it.
            goal: what was asked for.
        """
        terms = self.body.terms(sensed.q, sensed.v, memory.load)
        weights = self.weights._replace(mu=self.weights.mu - memory.mu_reduction)
        bounds = torque_bounds(sensed.v[6:], self._motors)
        return build(terms, sensed.R, sensed.p_foot, goal, weights, bounds)


def _row_of(task: Task, dt: float, new_sample: bool) -> Array:
    """A task as compiled code takes it, see `TaskLayout`."""
    row = np.empty(TASK_SIZE)
    row[TASK.deviation] = task.deviation
    # At once: each number that numpy is given by itself costs as much as this.
    numbers = task.vx, task.vy, task.wz, task.height, task.feedforward, dt, new_sample
    tilt = task.roll, task.pitch
    _NUMBERS.pack_into(row, _NUMBERS_AT, *numbers, *tilt)  # type: ignore[arg-type]  # a buffer
    return row


def _begin(memory: Array, sensed: Array) -> Sensed:
    """The first tick: feet are anchored where they are, the heading is kept."""
    memory[MEMORY.swing_start] = memory[MEMORY.foot_goal] = sensed[SENSED.p_foot]
    memory[MEMORY.yaw_des] = roll_pitch_yaw(sensed[SENSED.R].reshape(3, 3))[2]
    return Sensed(Memory(memory), sensed)
