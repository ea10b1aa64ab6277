"""The agent that plans for itself: when it plans, with what of its peers, when it plans again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from typing import Final

from quadriga.agents.planner.cooperation import brings_forward, is_cooperative, relevant_peers
from quadriga.agents.planner.neighbours import Neighbours
from quadriga.agents.planner.peer_memory import PeerMemory
from quadriga.agents.planner.peer_terms import PeerTerms
from quadriga.agents.planner.planner import Planner, PlannerInputs, PlannerState
from quadriga.agents.planner.qp_solver import SolvedQp
from quadriga.agents.planning.active_plan import ActivePlan
from quadriga.agents.planning.fade import fade_factor, outputs_to_follow, plan_message
from quadriga.agents.planning.interface import (
    NOTHING,
    REFUSED,
    Expected,
    PlanningInputs,
    PlanningOutputs,
)
from quadriga.agents.planning.operator_references import base_of_window
from quadriga.agents.planning.window import build_planner_inputs, is_gapless
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.time_grid import exchange_ms, first_step, owed_from, patience, step_ms
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Reference
from quadriga.shared.modes import PEER_LOST, WALK, WINDOW_LOST, Mode
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import SAMPLE_MS

WINDOW_GAP: Final = "window_gap"  # counter: no plan, a sample of the robot's own is missing


@record
class LocalState:
    """What an agent that plans for itself remembers.

    Attributes:
        peers: the peers' messages.
        own: the agent's last samples, T_ini of them.
        newest: step and exchange of the newest plan.
        terms: what the peers will do, for planning step `terms_step`.
        inputs: what the plan of the present step was made of.
        planner: what the planner remembers.
        begun: tick at which the robot began to walk, if that was not with its team; −1 else.
    """

    peers: PeerMemory
    own: tuple[Measurement, ...] = ()
    newest: tuple[int, int] = (-1, 0)
    terms: PeerTerms = field(default_factory=PeerTerms)
    terms_step: int = -1
    inputs: PlannerInputs | None = None
    planner: PlannerState = field(default_factory=PlannerState)
    begun: int = -1


@record
class _Request:
    """What the planner is asked at a tick: a new plan (exchange 0) or an answer to the peers'."""

    serial: tuple[int, int]
    inputs: PlannerInputs
    terms: PeerTerms


class LocalPlanning:
    """Fixed data of an agent's own planning; its functions depend on their arguments alone.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
        predictor: the fitted predictor.
        clock_ns: read around the planner; only `PlanningOutputs.planner_ns` depends on it.
    """

    def __init__(
        self, config: Config, index: int, predictor: Predictor, clock_ns: Callable[[], int]
    ) -> None:
        self._config, self._clock_ns = config, clock_ns
        self._step_ms, self._exchange_ms = step_ms(config), exchange_ms(config)
        self._first_step = first_step(config)
        self._neighbours = Neighbours(config, index, _coupled_peers(config, index, predictor))
        self._planner = Planner(config, index, predictor)

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements it takes in."""
        return self._neighbours.names

    def initial(self) -> LocalState:
        """No message, no sample, no plan."""
        return LocalState(self._neighbours.initial())

    def expected(self, tick: int) -> Expected:
        """The peers' plans of this step, some time after they were made; see `exchange_ms`."""
        step, rest = divmod(tick, self._step_ms)
        turn, off = divmod(rest, self._exchange_ms)
        last_turn = self._config.planner.exchanges + 1
        if off or turn < 1 or turn > last_turn or not self.peers:
            return NOTHING
        if step >= self._first_step:
            return Expected((step, turn - 1), step * self._step_ms)
        if step == self._first_step - 1 and turn == last_turn:
            return Expected(measurement_tick=step * self._step_ms)
        return Expected()

    def step(self, state: LocalState, inputs: PlanningInputs) -> tuple[LocalState, PlanningOutputs]:
        """Take in what arrived; plan, or answer the peers' plans, if it is time to."""
        state = self._begin_again(state, inputs.mode)
        state, request, unusual = self._take_in(state, inputs)
        if inputs.mode.name != WALK:
            return state, PlanningOutputs(unusual=unusual)
        if request is None:
            stop = self._stop_without_plan(state, inputs)
            return state, PlanningOutputs(stop_reason=stop, unusual=unusual)
        return self._solve(state, request, inputs.tick, unusual)

    def problem_of(self, state: LocalState, inputs: PlanningInputs) -> SolvedQp | None:
        """The QP that `step` solves for these arguments; None if it solves none."""
        state = self._begin_again(state, inputs.mode)
        state, request, _ = self._take_in(state, inputs)
        if request is None:
            return None
        return self._planner.problem_of(state.planner, request.inputs, request.terms)

    def is_whole(self, state: LocalState, tick: int) -> bool:
        """Whether its own window is whole, and its peers are heard and do not slow down."""
        own, T_ini = state.own, self._config.planner.T_ini
        if not own or tick - own[-1].tick >= SAMPLE_MS or not is_gapless(own, T_ini, own[-1].tick):
            return False
        return self._neighbours.are_ready(state.peers, tick)

    def _begin_again(self, state: LocalState, mode: Mode) -> LocalState:
        """The state without what was planned before the robot stopped, once it walks again."""
        since = mode.since
        if mode.name != WALK or since <= self._config.gait.stand_ms or since == state.begun:
            return state
        recent = since - patience(self._config) * self._step_ms
        peers = self._neighbours.forget_plans(state.peers, recent)
        return replace(state, peers=peers, terms=PeerTerms(), terms_step=-1, begun=since)

    def _first(self, state: LocalState) -> int:
        """The first planning step: the team's, or that of a robot which began to walk later."""
        return max(self._first_step, -(-state.begun // self._step_ms))

    def _take_in(
        self, state: LocalState, inputs: PlanningInputs
    ) -> tuple[LocalState, _Request | None, tuple[str, ...]]:
        """The state with all that has arrived, what the planner is asked now, and counters."""
        refused: tuple[str, ...] = ()
        arrived = inputs.plans or inputs.measurements
        if arrived:
            before = state.peers.refused
            peers = self._neighbours.remember(
                state.peers, inputs.tick, inputs.measurements, inputs.plans
            )
            state = replace(state, peers=peers)
            refused = (REFUSED,) * (peers.refused - before)
        if inputs.measurement is not None:
            own = (*state.own, inputs.measurement)[-self._config.planner.T_ini :]
            state = replace(state, own=own)
        # Between the ticks of plans and answers nothing is due but what arrivals make possible.
        idle = not arrived and inputs.tick % self._step_ms % self._exchange_ms
        if idle or inputs.mode.name != WALK:
            return state, None, refused
        state, request, unusual = self._request(state, inputs)
        return state, request, (*unusual, *refused)

    def _request(
        self, state: LocalState, inputs: PlanningInputs
    ) -> tuple[LocalState, _Request | None, tuple[str, ...]]:
        """What is due at a tick of walking: a plan, an answer, or the terms of the next plan."""
        step, rest = divmod(inputs.tick, self._step_ms)
        turn, off = divmod(rest, self._exchange_ms)
        unusual: tuple[str, ...] = ()
        if rest == 0 and step >= self._first_step:
            if is_gapless(state.own, self._config.planner.T_ini, inputs.tick):
                return *self._request_plan(state, step, inputs), ()
            unusual = (WINDOW_GAP,)
        if off == 0 and 1 <= turn <= self._config.planner.exchanges:
            return state, self._request_answer(state, (step, turn), inputs.references), ()
        arrived = inputs.plans or inputs.measurements
        last = (step, self._config.planner.exchanges)
        if arrived and state.terms_step != step + 1 and self._has_all(state, last):
            # All that the coming step needs of the peers is there: off the critical path.
            terms = self._terms(state, step + 1, inputs.references)
            state = replace(state, terms=terms, terms_step=step + 1)
        return state, None, unusual

    def _request_plan(
        self, state: LocalState, step: int, inputs: PlanningInputs
    ) -> tuple[LocalState, _Request]:
        terms = state.terms
        if state.terms_step != step:
            terms = self._terms(state, step, inputs.references)
        own = build_planner_inputs(self._config, step, inputs.tick, state.own, inputs.references)
        state = replace(state, terms=terms, terms_step=step, inputs=own)
        return state, _Request((step, 0), own, terms)

    def _request_answer(
        self, state: LocalState, serial: tuple[int, int], references: tuple[Reference, ...]
    ) -> _Request | None:
        """Plan the present step again with the peers' plans of it; skipped if some are late."""
        (step, turn), own = serial, state.inputs
        if own is None or own.step != step or not self._has_all(state, (step, turn - 1)):
            return None
        selection = self._neighbours.select(state.peers, step, self._first(state))
        base = base_of_window(self._config, step * self._step_ms, references)
        terms = self._planner.peer_terms(state.terms, selection, step, base)
        return _Request(serial, own, terms)

    def _has_all(self, state: LocalState, serial: tuple[int, int]) -> bool:
        return self._neighbours.is_complete(state.peers, serial)

    def _terms(self, state: LocalState, step: int, references: tuple[Reference, ...]) -> PeerTerms:
        """The peers' terms of a planning step, made of what they sent up to the step before."""
        end = step if brings_forward(self._config) else step - 1
        selection = self._neighbours.select(
            state.peers, step - 1, self._first(state), window_step=end
        )
        # The base of samples to come is the command of now, whenever this is computed.
        now = (step - 1) * self._step_ms
        base = base_of_window(self._config, end * self._step_ms, references, now)
        return self._planner.peer_terms(state.terms, selection, step, base)

    def _solve(
        self, state: LocalState, request: _Request, tick: int, unusual: tuple[str, ...]
    ) -> tuple[LocalState, PlanningOutputs]:
        config, own, terms = self._config.planner, request.inputs, request.terms
        begun = self._clock_ns()
        planner, result = self._planner.step(state.planner, own, terms)
        took = self._clock_ns() - begun if planner.solves > state.planner.solves else None
        factor = fade_factor(config, own.y_ini[-1] - own.y_des[0])
        plan_tick = own.step * self._step_ms
        active = ActivePlan(
            tick + config.latency_ms,
            plan_tick,
            factor * result.du,
            outputs_to_follow(result, factor, own.y_des),
        )
        behind = 0 if request.serial[1] else 1  # steps of the peers' plans before this one
        outputs = PlanningOutputs(
            plan_message(result, factor, request.serial, plan_tick),
            active,
            _peer_lost(result.lost) if result.lost else "",
            took,
            {f"plan.{p}": float(self._step_ms * (behind + age)) for p, age in terms.ages.items()},
            unusual,
        )
        return replace(state, planner=planner, newest=request.serial), outputs

    def _stop_without_plan(self, state: LocalState, inputs: PlanningInputs) -> str:
        """Why to stop at a tick without a new plan; "" for no reason.

        Asked at every tick: the one of the planning step may itself be missing.
        """
        step = inputs.tick // self._step_ms
        first = owed_from(self._config, inputs.mode.since)
        age = step - max(state.newest[0], first - 1)
        if age <= 0:
            return ""
        lost = self._neighbours.lost_peers(state.peers, step - 1, first)
        if lost:
            return _peer_lost(lost)
        return WINDOW_LOST if age > patience(self._config) else ""


def _peer_lost(names: tuple[str, ...]) -> str:
    return with_detail(PEER_LOST, ",".join(names))


def _coupled_peers(config: Config, index: int, predictor: Predictor) -> frozenset[int]:
    """Places of the robots whose plans matter to this agent."""
    if not find_kind(config.planner.kind).needs_peers:
        return frozenset()
    others = frozenset(range(config.team.robots)) - {index}
    if predictor.meta.neighbours == "all":
        return others
    if is_cooperative(config):
        return relevant_peers(predictor, index)
    return frozenset(j for j in others if predictor.couples(index, j))
