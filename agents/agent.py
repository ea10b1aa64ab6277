"""One robot's agent as a pure function: measurements and peers' messages in, commands out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace

import numpy as np

from quadriga.agents.controller.controller import Controller, Task
from quadriga.agents.controller.estimator import trunk_from_truth
from quadriga.agents.controller.memory import Memory
from quadriga.agents.controller.schedule import Schedule
from quadriga.agents.controller.sensed import Sensed
from quadriga.agents.controller.whole_body.problem import UNCONSTRAINED, WholeBodySolution
from quadriga.agents.gait import stance_of_half, stance_progress
from quadriga.agents.modes import (
    DAMPING,
    ESTOP,
    STAND,
    STOPPING,
    WALK,
    Mode,
    go_limp,
    step_mode,
    stop_safely,
)
from quadriga.agents.planner.qp_solver import SOLVED
from quadriga.agents.planning.interface import (
    NO_OUTPUTS,
    NOTHING,
    Expected,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
    PlanningState,
)
from quadriga.agents.planning.local import LocalPlanning
from quadriga.agents.planning.operator_references import in_force, remember_references
from quadriga.agents.planning.remote import RemotePlanning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.sampling import measured
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.robot.a1 import Array, robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.messages import Command, EStop, Measurement, Plan, Reference, State, Truth
from quadriga.shared.wire.topics import REFERENCE, REFERENCE_EPOCH_MS, SAMPLE_MS

_ZERO = np.zeros(12)
_STANDING = Schedule(stance_of_half(-1).astype(float), 0.5, -1)
_TRUTH_AGE_MS = 20  # of the simulator's word, where it stands in for an estimator
_LONGEST_DT = 0.02  # s, after a gap in the ticks the filters advance by no more than this
NO_ESTIMATE = "no-estimate"  # why a robot damps its joints: its orientation is not a number


@record
class Inputs:
    """Everything that reached the agent since its last step, sorted by robot, then tick.

    Attributes:
        state: the robot's own sensors at this tick.
        measurements: samples of peers, with the peer's name.
        plans: plans of peers, or of whoever plans for the robot, with the sender's name.
        references: what the operator asked for.
        estop: an emergency stop, if one came.
        truth: the simulator's word, only for the estimator "truth".
        excitation: force deviation to add, (12,), N, yaw frame; data collection only.
    """

    state: State
    measurements: tuple[tuple[str, Measurement], ...] = ()
    plans: tuple[tuple[str, Plan], ...] = ()
    references: tuple[Reference, ...] = ()
    estop: EStop | None = None
    truth: Truth | None = None
    excitation: Array | None = None

    @property
    def bare(self) -> bool:
        """Whether nothing but the state has come."""
        others = self.measurements or self.plans or self.references
        return not others and self.estop is None and self.truth is None


@record
class Outputs:
    """What one step of the agent gives: the command always, the rest when it is due.

    `planner_ns` is for telemetry: the planner's time by the agent's clock, None if it did not plan.
    """

    command: Command
    measurement: Measurement | None
    plan: Plan | None
    mode: str
    reason: str
    counters: Mapping[str, int]
    ages_ms: Mapping[str, float]
    planner_ns: int | None


@record
class AgentState:
    """Everything the agent remembers between ticks."""

    tick: int
    mode: Mode
    low_level: Memory | None = None
    references: tuple[Reference, ...] = ()
    pilot: PlanningState = field(default_factory=PlanningState)
    last_tau: Array = field(default_factory=lambda: np.zeros(12))
    failures: int = 0
    counters: Mapping[str, int] = field(default_factory=dict)


class Agent:
    """Fixed data of one robot's agent; `step` is a function of state and inputs alone.

    Args:
        config: the team's configuration.
        robot: the robot's name, r1 … rn.
        predictor: the fitted predictor; None: without one, on nominal forces or on the plans of a
            central planner.
        clock_ns: read around the planner for `Outputs.planner_ns`; nothing else depends on it.
    """

    def __init__(
        self,
        config: Config,
        robot: str,
        predictor: Predictor | None,
        clock_ns: Callable[[], int] = lambda: 0,
    ) -> None:
        self.config = config
        self.robot = robot
        self.index = robot_names(config.team.robots).index(robot)
        self._controller = Controller(config)
        self._by_truth = config.estimator.kind == "truth"
        self._stand_ms, self._stance_ms = config.gait.stand_ms, config.gait.stance_ms
        self._height = config.reference.height
        self._schedules = _schedules(config, self.index)
        self._pilot: PlanningInterface | None = None
        if config.planner.kind in CENTRAL:
            self._pilot = RemotePlanning(config, self.index)
        elif predictor is not None:
            self._pilot = LocalPlanning(config, self.index, predictor, clock_ns)
        self._fallen_cosine = math.cos(config.controller.fall_tilt)
        self._damping = config.controller.damping
        self._feedforward = config.planner.interface == "feedforward"
        self._planned_footholds = config.planner.footholds == "planned"

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements the agent takes in."""
        return self._pilot.peers if self._pilot is not None else ()

    def initial(self) -> AgentState:
        """The state before the first tick."""
        return AgentState(-1, Mode(STAND, 0))

    def awaited(self, tick: int) -> Expected:
        """What lock-step waits for before the step of `tick`."""
        awaited = NOTHING if self._pilot is None else self._pilot.awaited(tick)
        reference = tick if tick % REFERENCE_EPOCH_MS == 0 else None
        if reference is None and not self._by_truth:
            return awaited
        return replace(awaited, reference_tick=reference, truth=self._by_truth)

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        """Advance to the tick of `inputs.state`; that tick must be later than the last one."""
        tick = inputs.state.tick
        dt = 1e-3 if state.tick < 0 else min(_LONGEST_DT, 1e-3 * (tick - state.tick))
        references = remember_references(state.references, inputs.references, tick)
        reference, reference_age = in_force(references, tick, self._height)
        mode = self._mode(state, inputs, reference_age)
        schedule = self._schedule(tick, mode)
        seen = self._sense(state, inputs, schedule, dt)
        if not seen.upright >= self._fallen_cosine and not mode.limp:
            mode = go_limp(mode, tick, DAMPING, NO_ESTIMATE if math.isnan(seen.upright) else "fall")

        measurement = None
        # Where states were passed over, the mean is over those of its ticks at which the agent
        # stepped: a window without the sample would be of no use. None if its end was passed
        # over, or all of it: nobody knows what was applied in it.
        if tick % SAMPLE_MS == 0 and 0 <= tick - SAMPLE_MS <= state.tick:
            stance = self._schedule(tick - SAMPLE_MS, state.mode).stance  # during the sample
            measurement = measured(tick, seen.memory.mean_force, seen.outputs, stance)
        pilot, planned = state.pilot, NO_OUTPUTS
        if self._pilot is not None:
            heard = PlanningInputs(
                tick, mode, references, measurement, inputs.measurements, inputs.plans
            )
            pilot, planned = self._pilot.step(state.pilot, heard)
            if planned.stop_reason:
                mode = stop_safely(mode, tick, planned.stop_reason)

        task = self._task(tick, mode, reference, planned, inputs.excitation, schedule.progress)
        new_sample = tick // SAMPLE_MS != state.tick // SAMPLE_MS
        acted = self._controller.act(seen, schedule, task, dt, new_sample=new_sample)
        solution = acted.solution
        failures, mode = self._failures(state.failures, solution, mode, tick)
        counters = _counted(state.counters, planned, solution)
        command = self._command(tick, solution, state.last_tau, mode)
        new = AgentState(
            tick,
            mode,
            acted.memory,
            references,
            pilot,
            command.tau if solution.solved else state.last_tau,
            failures,
            counters,
        )
        return new, Outputs(
            command,
            measurement,
            planned.plan,
            mode.name,
            mode.reason,
            counters,
            {"reference": float(reference_age), **planned.ages_ms},
            planned.planner_ns,
        )

    def _mode(self, state: AgentState, inputs: Inputs, reference_age: int) -> Mode:
        """What the robot does from now on, as far as it is known before the tick."""
        tick, mode = inputs.state.tick, state.mode
        if mode.name != WALK:
            stand_ms, stance_ms = self._stand_ms, self._stance_ms
            boundary = (state.tick - stand_ms) // stance_ms != (tick - stand_ms) // stance_ms
            mode = step_mode(mode, tick, stand_ms, boundary)
        if inputs.estop is not None:
            mode = go_limp(mode, tick, ESTOP, f"estop:{inputs.estop.reason}")
        if reference_age > REFERENCE.max_age_ms and mode.name == WALK:
            mode = stop_safely(mode, tick, "reference-lost")
        return mode

    def _schedule(self, tick: int, mode: Mode) -> Schedule:
        if mode.name not in (WALK, STOPPING):
            return _STANDING
        return self._schedules[(tick - self._stand_ms) % len(self._schedules)]

    def _task(
        self,
        tick: int,
        mode: Mode,
        reference: Reference,
        planned: PlanningOutputs,
        excitation: Array | None,
        progress: float,
    ) -> Task:
        """The operator's wish with what is planned."""
        deviation, v_ref = planned.present.deviation, planned.present.v_ref
        if excitation is not None:
            deviation = deviation + excitation
        if mode.name != WALK:
            deviation = _ZERO
        factor = mode.speed_factor(tick)
        vx, vy = factor * reference.vx, factor * reference.vy
        ahead = None
        if v_ref is not None:
            if not self._feedforward:
                # Planned roll and pitch are not tracked: the reference would follow the error.
                vx, vy = float(v_ref[0, 0]), float(v_ref[0, 1])
            if self._planned_footholds:
                ahead = self._velocity_ahead(v_ref, progress)
        return Task(
            vx, vy, factor * reference.wz, reference.height, deviation, self._feedforward, ahead
        )

    def _velocity_ahead(self, v_ref: Array, progress: float) -> Array:
        """Mean planned velocity until the middle of the stance to come, (2,), m/s.

        Or as far as the plan reaches: it ends before that early in a swing.
        """
        samples = round((1.5 - progress) * self._stance_ms / SAMPLE_MS)
        mean: Array = v_ref[: max(1, samples)].mean(axis=0)
        return mean

    def _sense(self, state: AgentState, inputs: Inputs, schedule: Schedule, dt: float) -> Sensed:
        truth = inputs.truth
        # One that is lost or late is bridged by the filter.
        if self._by_truth and truth is not None and inputs.state.tick - truth.tick <= _TRUTH_AGE_MS:
            estimate = trunk_from_truth(truth, self.robot, inputs.state)
            return self._controller.place(state.low_level, estimate, schedule, dt)
        return self._controller.sense(state.low_level, inputs.state, schedule, dt)

    def _failures(
        self, failures: int, solution: WholeBodySolution, mode: Mode, tick: int
    ) -> tuple[int, Mode]:
        """How many ticks in a row had no solution, and what becomes of the mode."""
        if solution.solved:
            return 0, mode
        if failures + 1 >= self.config.controller.max_failures:
            mode = go_limp(mode, tick, DAMPING, f"qp-{solution.status}")
        return failures + 1, mode

    def _command(
        self, tick: int, solution: WholeBodySolution, last_tau: Array, mode: Mode
    ) -> Command:
        """The motor command: the QP's torques, the last good ones, or damping."""
        row = np.zeros(60)  # tau, q_des, v_des, kp, kd
        if mode.limp or not solution.solved:
            row[48:] = self._damping
        if not mode.limp:
            row[:12] = solution.tau if solution.solved else last_tau
        return Command.from_row(tick, tick * 1_000_000, row)


def _schedules(config: Config, index: int) -> tuple[Schedule, ...]:
    """A robot's gait at every tick of its period, the first one at the end of the stand."""
    made, stance = [], [stance_of_half(half).astype(float) for half in (0, 1)]
    for since in range(2 * config.gait.stance_ms):
        progress, half = stance_progress(config, index, config.gait.stand_ms + since)
        made.append(Schedule(stance[half], progress, half))
    return tuple(made)


def _counted(
    counters: Mapping[str, int], planned: PlanningOutputs, solution: WholeBodySolution
) -> Mapping[str, int]:
    """The counters with what was out of the ordinary at this tick."""
    names = []
    if planned.plan is not None and planned.plan.status != SOLVED:
        names.append(f"plan_{planned.plan.status.partition(':')[0]}")
    names += planned.unusual
    if solution.status != UNCONSTRAINED:
        names.append("qp_constrained" if solution.solved else "qp_failed")
    if not names:
        return counters
    return {**counters, **{name: counters.get(name, 0) + 1 for name in names}}
