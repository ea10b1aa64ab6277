"""One robot's agent as a pure function: measurements and peers' messages in, commands out.

A tick, from top to bottom, is `Agent._tick`: validate, estimate, plan, control, stop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any, Final, NamedTuple

import numpy as np

from quadriga.agents.controller.controller import command_row, control
from quadriga.agents.controller.trunk import TrunkCommand
from quadriga.agents.controller.whole_body_qp import UNCONSTRAINED, WholeBodySolution
from quadriga.agents.estimator.estimator import estimate, truth_row
from quadriga.agents.estimator.robot_state import RobotState, gains_row
from quadriga.agents.gait import Gait
from quadriga.agents.modes import (
    SILENCE_MS,
    ModeRules,
    ResumeState,
    Statuses,
    newest_statuses,
    ramp,
)
from quadriga.agents.planner.solver import SOLVED, SolvedQp
from quadriga.agents.planner.team import Collected
from quadriga.agents.planning.active_plan import PlanCheck, Setpoint, setpoint_at
from quadriga.agents.planning.interface import ActivePlan, Expected, PlanningInputs, PlanningOutputs
from quadriga.agents.planning.references import reference_at, remember_references
from quadriga.agents.planning.registry import build_planning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.stand_up import StandUp, StandUpRules
from quadriga.agents.step_io import Inputs as Inputs
from quadriga.agents.step_io import Outputs as Outputs
from quadriga.agents.validate import Validated, Validator
from quadriga.shared.codes import code_of
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, Measurement, Reference
from quadriga.shared.modes import (
    FALL,
    NO_ESTIMATE,
    PASSIVE,
    STAND,
    STOPPING,
    WALK,
    Mode,
    Stop,
    resolve_stops,
)
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import REFERENCE, REFERENCE_EPOCH_MS, SAMPLE_MS

_TRUTH_AGE_MS: Final = 20  # of the simulator's truth, where it stands in for an estimator
QP_CONSTRAINED: Final = "qp_constrained"  # counter: ticks at which a limit of the QP was active
_LONGEST_DT: Final = 0.02  # s, after a gap in the ticks the filters advance by no more than this


@record
class AgentState:
    """Everything the agent remembers between ticks.

    `planning` is known to the planner alone, `plans` are in force or waiting for their start;
    `stand_up` is there while the robot stands up; `readings` and `standing_since` are known to
    `agents.validate`.
    """

    tick: int
    mode: Mode
    planning: Any
    plans: tuple[ActivePlan, ...] = ()
    controller_state: RobotState | None = None
    references: tuple[Reference, ...] = ()
    last_tau: Array = field(default_factory=lambda: np.zeros(12))
    failures: int = 0
    counters: Mapping[str, int] = field(default_factory=dict)
    resume: ResumeState = field(default_factory=ResumeState)
    statuses: Statuses = field(default_factory=dict)
    stand_up: StandUp | None = None
    readings: Array | None = None
    standing_since: Array | None = None


class Acted(NamedTuple):
    """What the state of a tick alone has come to, before the rest of the step.

    Attributes:
        readings: remembered of the sensors, all valid.
        estimated: the robot before it was commanded.
        controlled: to remember of it.
        solution: of the whole-body QP, with torques that may be used.
    """

    readings: Array
    estimated: RobotState
    controlled: RobotState
    solution: WholeBodySolution


class Agent:
    """Fixed data of one robot's agent; `step` is a function of state and inputs alone.

    Args:
        predictor: the fitted predictor; None: without one, on nominal forces or on the plans of a
            central planner.
        clock_ns: read around the planner for `Outputs.planner_ns`; nothing else depends on it.
        collected: reads the collected episodes, for agents that plan with them.

    Attributes:
        gains: `gains_row`.
        gait: the robot's.
        validator: checks its readings.
        fallen_cosine: of the tilt of a trunk that has fallen.
        plans_at_once: whether a plan takes effect at the tick at which it is made.
    """

    def __init__(
        self,
        config: Config,
        robot: str,
        predictor: Predictor | None,
        clock_ns: Callable[[], int] = lambda: 0,
        collected: Collected | None = None,
    ) -> None:
        self.config = config
        self.robot = robot
        self.index = robot_names(config.team.robots).index(robot)
        self.gains = gains_row(config)
        self._planning = build_planning(config, self.index, predictor, clock_ns, collected)
        self._plan_check = PlanCheck(config, self.index)
        self._by_truth = config.estimator.kind == "truth"
        self._height = config.reference.height
        self._modes, self._stand_up = ModeRules(config, robot), StandUpRules(config)
        self.validator = Validator(config, self.index)
        self.gait = Gait(config, self.index)
        self.plans_at_once = self._planning.effect_ms == 0
        self._feedforward = config.planner.interface == "feedforward"
        # Planned height and tilt are in general not tracked: the reference would follow the error.
        self._tracks_all = not self._feedforward and config.planner.tracked == "outputs"
        self.fallen_cosine = math.cos(config.controller.fall_tilt)

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements the agent takes in."""
        return self._planning.peers

    def initial(self) -> AgentState:
        """The state before the first tick."""
        return AgentState(-1, Mode(STAND, 0), self._planning.initial())

    def expected(self, tick: int) -> Expected:
        """What lock-step waits for before the step of `tick`."""
        expected = self._planning.expected(tick)
        reference = tick if tick % REFERENCE_EPOCH_MS == 0 else None
        if reference is None and not self._by_truth:
            return expected
        return replace(expected, reference_tick=reference, truth=self._by_truth)

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        """Advance to the tick of `inputs.state`; that tick must be later than the last one."""
        if self._stands_up(state, inputs):
            return self._step_of_standing_up(state, inputs)
        return self._tick(state, inputs)[:2]

    def finish_step(
        self, state: AgentState, inputs: Inputs, acted: Acted
    ) -> tuple[AgentState, Outputs]:
        """As `step`, of a tick whose state has been answered: see `agents.plain_ticks`."""
        return self._tick(state, inputs, acted)[:2]

    def plain_until(self, state: AgentState) -> tuple[int, int]:
        """Until when ticks behind a state are plain: nothing happens in them but what is sensed.

        Returns:
            The first tick at which more is due than an answer, and the last one at which a plain
            tick answers: that before it where a plan takes effect at once, and that of `state`
            where none is plain.
        """
        tick, mode = state.tick, state.mode
        ramps = ramp(state.references, state.resume, tick) is not state.references
        if mode.name != WALK or self._by_truth or ramps or state.failures or state.readings is None:
            return tick, tick
        _, age = reference_at(state.references, tick, self._height)
        heard = min((status.tick for status in state.statuses.values()), default=tick)
        due = min(
            tick - tick % SAMPLE_MS + SAMPLE_MS,
            self._planning.next_due(tick),
            tick - age + REFERENCE.max_age_ms,
            heard + SILENCE_MS,
        )
        return due, due - self.plans_at_once

    def plain_command(self, state: AgentState, tick: int) -> tuple[int, Array]:
        """What the controller is asked at plain ticks from one behind `state` on, and until when.

        A row of `trunk.COMMAND`.
        """
        reference, _ = reference_at(state.references, tick, self._height)
        asked = self._trunk_command(tick, state.mode, reference, setpoint_at(state.plans, tick))
        begins = (*(plan.start for plan in state.plans), *(r.tick for r in state.references))
        change = min((begin for begin in begins if begin > tick), default=tick + SAMPLE_MS)
        new_sample = tick % SAMPLE_MS == 0
        change = tick + 1 if new_sample else min(change, tick - tick % SAMPLE_MS + SAMPLE_MS)
        return change, command_row(asked, new_sample=new_sample)

    def problems_of(
        self, state: AgentState, inputs: Inputs
    ) -> tuple[WholeBodySolution, SolvedQp | None] | None:
        """The QPs that `step` solves for these arguments, also where a closed form answers them.

        That of the controller, and that of planning, if it solved one; None of a step by which the
        robot stands up.
        """
        if self._stands_up(state, inputs):
            return None
        *_, asked, solution = self._tick(state, inputs)
        return solution, self._planning.problem_of(state.planning, asked)

    def _stands_up(self, state: AgentState, inputs: Inputs) -> bool:
        return state.stand_up is not None or self._stand_up.begins(state.mode, inputs)

    def _tick(
        self, state: AgentState, inputs: Inputs, acted: Acted | None = None
    ) -> tuple[AgentState, Outputs, PlanningInputs, WholeBodySolution]:
        """Validate, estimate, plan, control; the stops of all of these are resolved at the end.

        Besides the step's results it gives what its QPs were posed of.
        """
        tick = inputs.state.tick
        dt = 1e-3 if state.tick < 0 else min(_LONGEST_DT, 1e-3 * (tick - state.tick))

        if acted is None:
            read = self.validator.step(state.readings, inputs.state, 1e-3 * (tick - state.tick))
        else:
            read = Validated(acted.readings, inputs.state, imu=False, encoders=(), lost="")
        inputs = inputs if read.complete else replace(inputs, state=read.state)
        mode, resume = self._modes.course(state.mode, state.resume, state.tick, tick)
        references = remember_references(state.references, inputs.references, tick)
        followed = ramp(references, resume, tick)
        reference, reference_age = reference_at(followed, tick, self._height)
        statuses = newest_statuses(state.statuses, inputs.statuses)
        stops = self._modes.stops(mode, inputs, statuses, reference_age)
        if read.lost:
            stops.append(Stop(STAND, read.lost))

        schedule = self.gait.at(tick, mode)
        robot = self._estimate(state, inputs, schedule, dt) if acted is None else acted.estimated
        if not robot.upright >= self.fallen_cosine:
            stops.append(Stop(PASSIVE, NO_ESTIMATE if math.isnan(robot.upright) else FALL))

        measurement = self._sample_measurement(state, tick, robot)
        asked = PlanningInputs(tick, mode, followed, measurement, inputs.measurements, inputs.plans)
        planning, planned = self._planning.step(state.planning, asked)
        planned, plans = self._plan_check.admit(planned, asked, state.plans)
        if planned.stop_reason:
            stops.append(Stop(STOPPING, planned.stop_reason))

        if acted is None:
            # A plan that takes effect later changes nothing now, not even one that is refused.
            at_once = self.plans_at_once or mode.name != WALK
            setpoint = setpoint_at(plans if at_once else state.plans, tick)
            if inputs.excitation is not None:
                setpoint = Setpoint(setpoint.deviation + inputs.excitation, setpoint.y_ref)
            trunk = self._trunk_command(tick, mode, reference, setpoint)
            new_sample = tick // SAMPLE_MS != state.tick // SAMPLE_MS
            controlled, solution = control(robot, trunk, self.gains, new_sample=new_sample)
        else:
            controlled, solution = acted.controlled, acted.solution
        failures = 0 if solution.solved else state.failures + 1
        if failures >= self.config.controller.max_failures:
            stops.append(Stop(PASSIVE, f"qp-{solution.status}"))

        mode = resolve_stops(mode, tick, stops)
        tau = state.last_tau if failures else solution.tau  # the QP's, or the last good ones
        standing_since, command = None, self._command(tick, tau, mode, solved=not failures)
        if mode.name == STAND and not read.complete:
            standing_since, command = self.validator.stand(state.standing_since, read)

        inputs_ok = (
            mode.name == STAND
            and mode.may_resume
            and read.complete
            and reference_age <= REFERENCE.max_age_ms
            and self._modes.peers_ready(statuses, tick)
            and self._planning.is_whole(planning, tick)
        )
        new = AgentState(
            tick,
            mode,
            planning,
            plans,
            controller_state=controlled,
            references=references,
            last_tau=tau,
            failures=failures,
            counters=_count(state.counters, planned, solution, read),
            resume=self._modes.remember(resume, mode, inputs, inputs_ok=inputs_ok),
            statuses=statuses,
            readings=read.memory,
            standing_since=standing_since,
        )
        outputs = Outputs(
            command,
            measurement,
            planned.plan,
            mode.name,
            mode.reason,
            new.counters,
            {"reference": float(reference_age), **planned.ages_ms},
            planned.planner_ns,
        )
        return new, outputs, asked, solution

    def _step_of_standing_up(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        """Stand up by a tick: nothing is estimated or planned before the robot stands."""
        tick, statuses = inputs.state.tick, newest_statuses(state.statuses, inputs.statuses)
        before = state.mode.since if state.stand_up is not None else tick
        may_move = self._modes.peers_rest(statuses, tick, before)
        mode, stand_up, command = self._stand_up.step(
            state.mode, state.stand_up, inputs, may_move=may_move
        )
        new = AgentState(
            tick,
            mode,
            state.planning,
            references=remember_references(state.references, inputs.references, tick),
            counters=state.counters,
            resume=self._modes.remember(state.resume, mode, inputs, inputs_ok=False),
            statuses=statuses,
            stand_up=stand_up,
        )
        outputs = Outputs(command, None, None, mode.name, mode.reason, state.counters, {}, None)
        return new, outputs

    def _estimate(
        self, state: AgentState, inputs: Inputs, schedule: Array, dt: float
    ) -> RobotState:
        truth, known = inputs.truth, None
        # One that is lost or late is bridged by the filter.
        if self._by_truth and truth is not None and inputs.state.tick - truth.tick <= _TRUTH_AGE_MS:
            known = truth_row(truth, self.robot)
        return estimate(state.controller_state, inputs.state, schedule, dt, self.gains, known)

    def _sample_measurement(
        self, state: AgentState, tick: int, robot: RobotState
    ) -> Measurement | None:
        """The 100 Hz sample that ends at `tick`: mean planned force, outputs at its last tick.

        None at a tick at which none ends.

        Where states were passed over, the mean is over those of its ticks at which the agent
        stepped: a window without the sample would be of no use. None if its end was passed over,
        or all of it: nobody knows what was applied in it.
        """
        begun = tick - SAMPLE_MS
        if tick % SAMPLE_MS or begun < 0 or begun > state.tick:
            return None
        u = robot.force_sum / max(1.0, robot.force_count)
        stance = self.gait.at(begun, state.mode)[:4]
        return Measurement(tick, tick * 1_000_000, u, robot.outputs, stance)

    def _trunk_command(
        self, tick: int, mode: Mode, reference: Reference, setpoint: Setpoint
    ) -> TrunkCommand:
        """What the controller is asked: the reference, with what the plan in force says of it."""
        deviation, planned = setpoint
        if mode.name != WALK:
            deviation = np.zeros(12)
        share = mode.speed_factor(tick)
        vx, vy, wz = share * reference.vx, share * reference.vy, share * reference.wz
        height, roll, pitch = reference.height, 0.0, 0.0
        if planned is not None and not self._feedforward:
            vx, vy = float(planned[1]), float(planned[2])
            if self._tracks_all:
                height, _, _, roll, pitch, wz = map(float, planned)
        return TrunkCommand(vx, vy, wz, height, deviation, self._feedforward, roll, pitch)

    def _command(self, tick: int, tau: Array, mode: Mode, *, solved: bool) -> Command:
        """The motor command: torques, with damping where they are not this tick's, or damping."""
        row = np.zeros(60)
        if mode.passive or not solved:
            row[Command.CUTS["kd"]] = self.config.controller.damping
        if not mode.passive:
            row[Command.CUTS["tau"]] = tau
        return Command.from_row(tick, tick * 1_000_000, row)


def _count(
    counters: Mapping[str, int],
    planned: PlanningOutputs,
    solution: WholeBodySolution,
    read: Validated,
) -> Mapping[str, int]:
    """The counters after a tick: whatever was out of the ordinary."""
    names = ["imu_invalid"] if read.imu else []
    if read.encoders:
        names.append("encoder_invalid")
    if planned.plan is not None and planned.plan.status != SOLVED:
        names.append(f"plan_{code_of(planned.plan.status)}")
    names += planned.unusual
    if solution.status != UNCONSTRAINED:
        names.append(QP_CONSTRAINED if solution.solved else "qp_failed")
    if not names:
        return counters
    return {**counters, **{name: counters.get(name, 0) + 1 for name in names}}
