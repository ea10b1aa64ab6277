"""One robot's agent as a pure function: measurements and peers' messages in, commands out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from agents.controller.controller import Controller, ControllerState, Schedule, Task
from agents.controller.estimator import (
    Estimate,
    FilterState,
    estimate_trunk,
    filter_at,
    foot_trust,
    initial_filter,
    noise_parameters,
    trunk_from_truth,
)
from agents.controller.rotation import roll_pitch_yaw
from agents.controller.whole_body_qp import Solution
from agents.following import Follower
from agents.gait import nominal_forces, stance_of_half, stance_progress
from agents.modes import (
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
from agents.pilot import NOTHING, Awaited, Heard, Pilot, PilotState, Planned
from agents.planner.predictor import Predictor
from agents.planning import LocalPilot
from agents.references import in_force, remember_references
from agents.sampling import SAMPLE_MS, ForceMean, measured, no_force, outputs_of
from shared.config import CENTRAL, Config
from shared.messages import Command, EStop, Measurement, Plan, Reference, State, Truth
from shared.robot import Array, robot_names
from shared.topics import REFERENCE

_ZERO = _NO_FORCE = np.zeros(12)
# By half period (−1: standing): stance of the legs, of the forces, and the nominal forces.
_STANCE = {half: stance_of_half(half).astype(float) for half in (-1, 0, 1)}
_STANCE_OF_FORCE = {half: np.repeat(stance, 3) for half, stance in _STANCE.items()}
_NOMINAL = {half: nominal_forces(stance > 0.5) for half, stance in _STANCE.items()}
_LONGEST_DT = 0.02  # s, after a gap in the ticks the filters advance by no more than this
REFERENCE_EPOCH_MS = 100  # the operator speaks at multiples of this


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class AgentState:
    """Everything the agent remembers between ticks."""

    tick: int
    mode: Mode
    filter: FilterState | None = None
    controller: ControllerState | None = None
    references: tuple[Reference, ...] = ()
    forces: ForceMean = field(default_factory=no_force)
    pilot: PilotState = field(default_factory=PilotState)
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
        self, config: Config, robot: str, predictor: Predictor | None,
        clock_ns: Callable[[], int] = lambda: 0,
    ) -> None:  # fmt: skip
        self.config = config
        self.robot = robot
        self.index = robot_names(config.team.robots).index(robot)
        self._controller = Controller(config)
        self._noise = noise_parameters(config.estimator)
        self._pilot: Pilot | None = None
        if config.planner.kind in CENTRAL:
            self._pilot = Follower(config, self.index)
        elif predictor is not None:
            self._pilot = LocalPilot(config, self.index, predictor, clock_ns)
        self._fallen_cosine = math.cos(config.controller.fall_tilt)
        self._damping = np.full(12, config.controller.damping)
        self._feedforward = config.planner.interface == "feedforward"

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements the agent takes in."""
        return self._pilot.peers if self._pilot is not None else ()

    def initial(self) -> AgentState:
        """The state before the first tick."""
        return AgentState(-1, Mode(STAND, 0))

    def awaited(self, tick: int) -> Awaited:
        """What lock-step waits for before the step of `tick`."""
        awaited = NOTHING if self._pilot is None else self._pilot.awaited(tick)
        reference = tick if tick % REFERENCE_EPOCH_MS == 0 else None
        if reference is None and not self._by_truth:
            return awaited
        return replace(awaited, reference_tick=reference, truth=self._by_truth)

    @property
    def _by_truth(self) -> bool:
        return self.config.estimator.kind == "truth"

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        """Advance to the tick of `inputs.state`; that tick must be later than the last one."""
        tick = inputs.state.tick
        dt = 1e-3 if state.tick < 0 else min(_LONGEST_DT, 1e-3 * (tick - state.tick))
        counters = dict(state.counters)
        references = remember_references(state.references, inputs.references, tick)
        reference, reference_age = in_force(references, tick, self.config.reference.height)

        mode = step_mode(
            state.mode, tick, self.config.gait.stand_ms, self._half_boundary(state.tick, tick)
        )
        if inputs.estop is not None:
            mode = go_limp(mode, tick, ESTOP, f"estop:{inputs.estop.reason}")
        if mode.name == WALK and reference_age > REFERENCE.max_age_ms:
            mode = stop_safely(mode, tick, "reference-lost")

        schedule = self._schedule(tick, mode)
        filter_state, estimate = self._estimate(state, inputs, schedule, dt)
        controller = state.controller or self._controller.initial(
            estimate, float(roll_pitch_yaw(estimate.R)[2])
        )
        outputs = outputs_of(estimate, controller.contact.level)
        if not mode.limp and estimate.R[2, 2] < self._fallen_cosine:
            mode = go_limp(mode, tick, DAMPING, "fall")

        measurement, forces = None, state.forces
        if tick % SAMPLE_MS == 0 and tick > 0:
            measurement = measured(tick, forces, outputs, self._stance_before(tick, state.mode))
            forces = no_force()
        pilot, planned = state.pilot, Planned()
        if self._pilot is not None:
            heard = Heard(tick, mode, references, measurement, inputs.measurements, inputs.plans)
            pilot, planned = self._pilot.step(state.pilot, heard)
            if planned.stop_reason:
                mode = stop_safely(mode, tick, planned.stop_reason)
            if planned.plan is not None and planned.plan.status != "solved":
                _count(counters, f"plan_{planned.plan.status.partition(':')[0]}")

        factor = mode.speed_factor(tick)
        deviation = planned.present.deviation
        if inputs.excitation is not None:
            deviation = deviation + inputs.excitation
        deviation = deviation * _STANCE_OF_FORCE[schedule.half] if mode.name == WALK else _NO_FORCE
        velocity = planned.present.velocity
        if velocity is None:
            velocity = factor * np.array([reference.vx, reference.vy])
        task = Task(velocity, factor * reference.wz, reference.height, deviation, self._feedforward)
        controller, solution = self._controller.step(
            controller, estimate, inputs.state.imu_quat_wxyz, schedule, task, dt
        )
        failures, mode = self._count_failures(state.failures, solution, counters, mode, tick)
        command = self._command(tick, solution, state.last_tau, mode)
        applied = _NOMINAL[schedule.half] + deviation
        new = AgentState(
            tick, mode, filter_state, controller, references, forces.add(applied), pilot,
            command.tau if solution.solved else state.last_tau, failures, counters,
        )  # fmt: skip
        ages = {"reference": float(reference_age), **planned.ages_ms}
        return new, Outputs(
            command, measurement, planned.plan, mode.name, mode.reason, counters, ages,
            planned.planner_ns,
        )  # fmt: skip

    def _half_boundary(self, last: int, tick: int) -> bool:
        stance_ms, stand_ms = self.config.gait.stance_ms, self.config.gait.stand_ms
        return (last - stand_ms) // stance_ms != (tick - stand_ms) // stance_ms

    def _schedule(self, tick: int, mode: Mode) -> Schedule:
        if mode.name not in (WALK, STOPPING):
            return Schedule(_STANCE[-1], 0.5, -1)
        progress, half = stance_progress(self.config, self.index, tick)
        return Schedule(_STANCE[half], progress, half)

    def _stance_before(self, tick: int, mode: Mode) -> Array:
        """Scheduled stance during the sample that ends at `tick`. Shape (4,)."""
        return self._schedule(tick - SAMPLE_MS, mode).stance

    def _estimate(
        self, state: AgentState, inputs: Inputs, schedule: Schedule, dt: float
    ) -> tuple[FilterState, Estimate]:
        previous = state.filter or initial_filter(inputs.state)
        if self._by_truth and inputs.truth is not None:
            estimate = trunk_from_truth(inputs.truth, self.index, inputs.state)
            return filter_at(estimate), estimate  # a tick whose truth is lost goes on from here
        trust = foot_trust(
            schedule.stance, schedule.progress, inputs.state.foot_force,
            self.config.estimator.trust_ramp, self.config.estimator.contact_force,
        )  # fmt: skip
        return estimate_trunk(previous, inputs.state, trust, self._noise, dt)

    def _count_failures(
        self, failures: int, solution: Solution, counters: dict[str, int], mode: Mode, tick: int
    ) -> tuple[int, Mode]:
        if solution.solved:
            if solution.status == "constrained":
                _count(counters, "qp_constrained")
            return 0, mode
        _count(counters, "qp_failed")
        if failures + 1 >= self.config.controller.max_failures:
            mode = go_limp(mode, tick, DAMPING, f"qp-{solution.status}")
        return failures + 1, mode

    def _command(self, tick: int, solution: Solution, last_tau: Array, mode: Mode) -> Command:
        """The motor command: the QP's torques, the last good ones, or damping."""
        if mode.limp:
            return Command(tick, tick * 1_000_000, _ZERO, _ZERO, _ZERO, _ZERO, self._damping)
        if not solution.solved:
            return Command(tick, tick * 1_000_000, last_tau, _ZERO, _ZERO, _ZERO, self._damping)
        return Command(tick, tick * 1_000_000, solution.tau, _ZERO, _ZERO, _ZERO, _ZERO)


def _count(counters: dict[str, int], name: str) -> None:
    counters[name] = counters.get(name, 0) + 1
