"""One robot's agent as a pure function: measurements and peers' messages in, commands out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Final

import numpy as np

from quadriga.agents.controller.controller import Controller, ControllerOutputs
from quadriga.agents.controller.estimator import trunk_from_truth
from quadriga.agents.controller.foot_load import foot_load_rule
from quadriga.agents.controller.memory import Memory
from quadriga.agents.controller.schedule import Schedule
from quadriga.agents.controller.sensed import Sensed
from quadriga.agents.controller.whole_body.problem import WholeBodyProblem, WholeBodySolution
from quadriga.agents.counters import count
from quadriga.agents.healing import Healing, may_resume, ramp, step_healing
from quadriga.agents.modes import (
    DAMPING,
    ESTOP,
    FALL,
    NO_ESTIMATE,
    PEER_LOST,
    REFERENCE_LOST,
    RISING,
    STAND,
    STOPPED,
    STOPPING,
    WALK,
    Mode,
    Stop,
    resolve_stops,
    rests,
    step_mode,
    stop_safely,
)
from quadriga.agents.planner.solver import SolvedQp
from quadriga.agents.planner.team import Collected
from quadriga.agents.planning.active_plan import setpoint_at
from quadriga.agents.planning.interface import Expected, PlanningInputs
from quadriga.agents.planning.references import reference_at, remember_references
from quadriga.agents.planning.registry import PlanningState, build_planning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.rising import Rise, Rising
from quadriga.agents.schedules import Schedules
from quadriga.agents.step_io import Inputs as Inputs
from quadriga.agents.step_io import Outputs as Outputs
from quadriga.agents.tasks import Tasks
from quadriga.agents.teammates import Teammates, TeamWatch, has_operator
from quadriga.agents.validate import Validator
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, Measurement, Reference
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import REFERENCE, REFERENCE_EPOCH_MS, SAMPLE_MS

_TRUTH_AGE_MS: Final = 20  # of the simulator's truth, where it stands in for an estimator
_LONGEST_DT: Final = 0.02  # s, after a gap in the ticks the filters advance by no more than this


@record
class AgentState:
    """Everything the agent remembers between ticks.

    `rise` is there while the robot gets up; `readings` and `standing_since` are known to
    `agents.validate`.
    """

    tick: int
    mode: Mode
    planning: PlanningState
    low_level: Memory | None = None
    references: tuple[Reference, ...] = ()
    last_tau: Array = field(default_factory=lambda: np.zeros(12))
    failures: int = 0
    counters: Mapping[str, int] = field(default_factory=dict)
    healing: Healing = field(default_factory=Healing)
    team: Teammates = field(default_factory=Teammates)
    rise: Rise | None = None
    readings: Array | None = None
    standing_since: Array | None = None


@record
class StepProblems:
    """The QPs of one step, with their answers.

    Attributes:
        whole_body: of the controller.
        whole_body_solution: its answer.
        planner: of the planning part; None if it solved none.
    """

    whole_body: WholeBodyProblem
    whole_body_solution: WholeBodySolution
    planner: SolvedQp | None


class Agent:
    """Fixed data of one robot's agent; `step` is a function of state and inputs alone.

    Args:
        config: the team's configuration.
        robot: the robot's name, r1 … rn.
        predictor: the fitted predictor; None: without one, on nominal forces or on the plans of a
            central planner.
        clock_ns: read around the planner for `Outputs.planner_ns`; nothing else depends on it.
        collected: reads the collected episodes, for agents that plan with them.
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
        self._controller = Controller(config)
        self._planning = build_planning(config, self.index, predictor, clock_ns, collected)
        self._by_truth = config.estimator.kind == "truth"
        self._stand_ms, self._stance_ms = config.gait.stand_ms, config.gait.stance_ms
        self._height = config.reference.height
        self._watch, self._rising = TeamWatch(config, robot), Rising(config)
        self._validator = Validator(config, self.index)
        self._schedules = Schedules(config, self.index)
        self._tasks = Tasks(config)
        self._fallen_cosine = math.cos(config.controller.fall_tilt)
        self._damping = config.controller.damping
        self._max_failures = config.controller.max_failures
        self._auto_resume = config.team.auto_resume
        self._whole_ms = round(1000 * config.team.resume_after)

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
        if self.gets_up(state, inputs):
            return self._rise(state, inputs)
        new, outputs, _ = self._run(state, inputs)
        return new, outputs

    def gets_up(self, state: AgentState, inputs: Inputs) -> bool:
        """Whether the robot, which has been down, gets up in the step of these arguments."""
        if state.rise is not None:
            return True
        # Who answered the tick before has not been down since, unless somebody says so.
        said = inputs.reset is not None or bool(inputs.events)
        return (said or inputs.state.tick - state.tick > 1) and bool(self._why_rise(state, inputs))

    def _why_rise(self, state: AgentState, inputs: Inputs) -> str:
        """Why the robot begins to get up at this tick; "": it does not."""
        lowered = bool(inputs.events) and self._watch.is_led_down(inputs.events)
        return self._rising.why_now(
            state.mode, state.tick, inputs.state.tick, inputs.reset, inputs.estop, lowered=lowered
        )

    def _rise(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        """Get up by a tick: nothing is estimated or planned before the robot stands."""
        tick, team = inputs.state.tick, self._look_around(state, inputs)
        before, mode = state.rise, state.mode
        if reason := self._why_rise(state, inputs):  # maybe once more
            before, mode = None, Mode(RISING, tick, reason)
        still = self._watch.are_still(team, tick, mode.since) and not team.unheeded
        mode, rise, command = self._rising.step(
            mode, before, inputs.state, may_begin=still, estop=inputs.estop
        )
        if inputs.stop is not None:
            mode = stop_safely(mode, tick, with_detail(STOPPED, inputs.stop.reason))
        healing = self._heal(state.healing, mode, inputs, whole=False)
        references = remember_references(state.references, inputs.references, tick)
        new = AgentState(
            tick,
            mode,
            state.planning,
            references=references,
            counters=state.counters,
            healing=healing,
            team=team,
            rise=rise,
        )
        outputs = Outputs(command, None, None, mode.name, mode.reason, state.counters, {}, None)
        return new, outputs

    def _look_around(self, state: AgentState, inputs: Inputs) -> Teammates:
        """What is known of the other robots after a tick."""
        if not (inputs.statuses or inputs.events):
            return state.team
        return self._watch.remember(state.team, inputs.statuses, inputs.events)

    def problems_of(self, state: AgentState, inputs: Inputs) -> StepProblems:
        """The QPs that `step` solves for these arguments, also where a closed form answers them."""
        _, _, (sensed, planning_inputs, acted) = self._run(state, inputs)
        whole_body = self._controller.problem(sensed, acted.memory, acted.goal)
        planner = self._planning.problem_of(state.planning, planning_inputs)
        return StepProblems(whole_body, acted.solution, planner)

    def _run(
        self, state: AgentState, inputs: Inputs
    ) -> tuple[AgentState, Outputs, tuple[Sensed, PlanningInputs, ControllerOutputs]]:
        """Sense, plan, act. Each of them sees the mode after the stops that came up before it."""
        tick = inputs.state.tick
        dt = 1e-3 if state.tick < 0 else min(_LONGEST_DT, 1e-3 * (tick - state.tick))
        read = self._validator.step(state.readings, inputs.state, 1e-3 * (tick - state.tick))
        inputs = inputs if read.complete else replace(inputs, state=read.state)
        references = remember_references(state.references, inputs.references, tick)
        course, healing = self._course(state, tick, read.lost)
        team = self._look_around(state, inputs)
        followed = ramp(references, healing, tick)
        reference, reference_age = reference_at(followed, tick, self._height)

        led = reference_age <= REFERENCE.max_age_ms and has_operator(team, references)
        stops = self._stops_on_arrival(inputs, course, team, led=led)
        mode = resolve_stops(course, tick, stops) if stops else course
        schedule = self._schedules.at(tick, mode)
        sensed = self._sense(state, inputs, schedule, dt)
        if not sensed.upright >= self._fallen_cosine:
            stops.append(Stop(DAMPING, NO_ESTIMATE if math.isnan(sensed.upright) else FALL))
            mode = resolve_stops(course, tick, stops)

        measurement = self._sample_measurement(state, tick, sensed)
        asked = PlanningInputs(tick, mode, followed, measurement, inputs.measurements, inputs.plans)
        planning, planned = self._planning.step(state.planning, asked)
        if planned.stop_reason:
            stops.append(Stop(STOPPING, planned.stop_reason))
            mode = resolve_stops(course, tick, stops)

        setpoint = setpoint_at(planning.plans, tick)
        task = self._tasks.build(tick, mode, reference, setpoint, inputs.excitation)
        new_sample = tick // SAMPLE_MS != state.tick // SAMPLE_MS
        acted = self._controller.act(sensed, schedule, task, dt, new_sample=new_sample)
        solution, failures = acted.solution, 0
        if not solution.solved:
            failures = state.failures + 1
            if failures >= self._max_failures:
                stops.append(Stop(DAMPING, f"qp-{solution.status}"))
                mode = resolve_stops(course, tick, stops)

        tau = solution.tau if not failures else state.last_tau  # the QP's, or the last good ones
        if mode.name == STAND and not read.complete:
            since, command = self._validator.stand(state.standing_since, read)
        else:
            since, command = None, self._command(tick, tau, mode, solved=not failures)
        counters = count(state.counters, planned, solution, read)
        ages = {"reference": float(reference_age), **planned.ages_ms}
        said = (measurement, planned.plan, mode.name, mode.reason, counters, ages)
        outputs = Outputs(command, *said, planned.planner_ns)
        whole = led and read.complete and self._is_whole(tick, mode, team, planning)
        healing = self._heal(healing, mode, inputs, whole=whole)
        after = (references, tau, failures, counters, healing, team, None, read.memory, since)
        new = AgentState(tick, mode, planning, acted.memory, *after)
        return new, outputs, (sensed, asked, acted)

    def _stops_on_arrival(
        self, inputs: Inputs, course: Mode, team: Teammates, *, led: bool
    ) -> list[Stop]:
        """Stops that what arrived, or did not arrive, asks for."""
        stops: list[Stop] = []
        estop = inputs.estop
        if estop is not None:
            stops.append(Stop(ESTOP, with_detail(ESTOP, estop.reason)))
        if inputs.stop is not None:
            stops.append(Stop(STOPPING, with_detail(STOPPED, inputs.stop.reason)))
        if course.name != WALK:
            return stops
        if not led:
            stops.append(Stop(STOPPING, REFERENCE_LOST))
        lost = self._watch.find_lost(team, inputs.state.tick, course.since)
        if lost:
            stops.append(Stop(STOPPING, with_detail(PEER_LOST, ",".join(lost))))
        return stops

    def _is_whole(self, tick: int, mode: Mode, team: Teammates, planning: PlanningState) -> bool:
        """Whether a robot that stands, and may go on, has all plans, and the others can walk."""
        if mode.name != STAND or not rests(mode):
            return False
        return self._watch.are_ready(team, tick) and self._planning.is_whole(planning, tick)

    def _heal(self, healing: Healing, mode: Mode, inputs: Inputs, *, whole: bool) -> Healing:
        """The way back from standing after a tick at which all inputs are `whole`, or not."""
        tick, whole_from = inputs.state.tick, None
        if whole:
            whole_from = tick + self._stance_ms - (tick - self._stand_ms) % self._stance_ms
        word = -1 if inputs.resume is None else inputs.resume.tick
        # Who did not know the time said 0; nobody can know one that is still to come.
        stop = -1 if inputs.stop is None else min(inputs.stop.tick or tick, tick)
        return step_healing(healing, mode, tick, whole_from=whole_from, word=word, stop=stop)

    def _course(self, state: AgentState, tick: int, loss: str) -> tuple[Mode, Healing]:
        """The mode if nothing but a `loss` stops the robot at this tick, and its way back."""
        mode, healing = state.mode, state.healing
        if loss and mode.name in (WALK, STOPPING):
            return Mode(STAND, tick, loss), healing
        if mode.name == WALK:
            return mode, healing
        stand_ms, stance_ms = self._stand_ms, self._stance_ms
        ends = (state.tick - stand_ms) // stance_ms != (tick - stand_ms) // stance_ms
        auto, whole_ms = self._auto_resume, self._whole_ms
        if ends and may_resume(healing, mode, tick, auto=auto, whole_ms=whole_ms):
            return Mode(WALK, tick), replace(healing, resumed=tick)
        return step_mode(mode, tick, stand_ms, ends), healing

    def _sense(self, state: AgentState, inputs: Inputs, schedule: Schedule, dt: float) -> Sensed:
        truth = inputs.truth
        # One that is lost or late is bridged by the filter.
        if self._by_truth and truth is not None and inputs.state.tick - truth.tick <= _TRUTH_AGE_MS:
            estimate = trunk_from_truth(
                truth,
                self.robot,
                inputs.state,
                self.config.robot.geometry,
                foot_load_rule(self.config),
            )
            return self._controller.place(state.low_level, estimate, schedule, dt)
        return self._controller.sense(state.low_level, inputs.state, schedule, dt)

    def _sample_measurement(
        self, state: AgentState, tick: int, sensed: Sensed
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
        stance = self._schedules.at(begun, state.mode).stance
        return Measurement(tick, tick * 1_000_000, sensed.memory.mean_force, sensed.outputs, stance)

    def _command(self, tick: int, tau: Array, mode: Mode, *, solved: bool) -> Command:
        """The motor command: torques, with damping where they are not this tick's, or damping."""
        row = np.zeros(60)  # tau, q_des, v_des, kp, kd
        passive = mode.passive
        if passive or not solved:
            row[48:] = self._damping
        if not passive:
            row[:12] = tau
        return Command.from_row(tick, tick * 1_000_000, row)
