"""The agent that plans for itself: when it plans, with what of its peers, when it plans again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from typing import Final

from quadriga.agents.gait import exchange_ms, first_due_step, first_step, patience, step_ms
from quadriga.agents.planner.cooperation import brings_forward, coupled_peers
from quadriga.agents.planner.peers import Neighbours, PeerMemory, Peers, PeerTerms
from quadriga.agents.planner.planner import Planner, PlannerInputs, PlannerState
from quadriga.agents.planner.solver import SOLVED, SolvedQp
from quadriga.agents.planning.active_plan import FADED, trust_scaling
from quadriga.agents.planning.interface import (
    NOTHING,
    REFUSED,
    ActivePlan,
    Expected,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.planning.references import base_of_window, build_planner_inputs, is_gapless
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.modes import PEER_LOST, WALK, WINDOW_LOST
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import SAMPLE_MS

WINDOW_GAP: Final = "window_gap"  # counter: no plan, a sample of the robot's own is missing


@record
class LocalState:
    """What an agent that plans for itself remembers.

    Attributes:
        peers: the peers' messages.
        own: the agent's last samples, T_ini of them.
        inputs: what the plan of the present step was made of.
        planner: what the planner remembers.
    """

    peers: PeerMemory
    own: tuple[Measurement, ...] = ()
    inputs: PlannerInputs | None = None
    planner: PlannerState = field(default_factory=PlannerState)


# What the planner is asked at a tick: step and exchange of a new plan (exchange 0) or of an answer
# to the peers', the robot's own data, what its peers will do.
_Request = tuple[tuple[int, int], PlannerInputs, PeerTerms]


class LocalPlanning(PlanningInterface[LocalState]):
    """How the agent `index`, 0-based, plans for itself; functions of their arguments alone.

    `clock_ns` is read around the planner; only `PlanningOutputs.planner_ns` depends on it.
    """

    def __init__(
        self, config: Config, index: int, predictor: Predictor, clock_ns: Callable[[], int]
    ) -> None:
        self._config, self._clock_ns = config, clock_ns
        self._step_ms, self._exchange_ms = step_ms(config), exchange_ms(config)
        self._first_step = first_step(config)
        self._neighbours = Neighbours(config, index, coupled_peers(config, index, predictor))
        self._planner = Planner(config, index, predictor)
        self._coupling = Peers(config, index, predictor)

    @property
    def peers(self) -> tuple[str, ...]:
        return self._neighbours.names

    @property
    def effect_ms(self) -> int:
        return self._config.planner.latency_ms

    def next_due(self, tick: int) -> int:
        """When the present exchange is over, or the planning step."""
        step, exchange, _ = self._place(tick)
        return self._step_ms * step + min(self._exchange_ms * (exchange + 1), self._step_ms)

    def initial(self) -> LocalState:
        return LocalState(self._neighbours.initial())

    def expected(self, tick: int) -> Expected:
        """The peers' plans of this step, some time after they were made; see `exchange_ms`."""
        step, exchange, off = self._place(tick)
        last = self._config.planner.exchanges + 1
        if off or exchange < 1 or exchange > last or not self.peers:
            return NOTHING
        if step >= self._first_step:
            return Expected((step, exchange - 1), step * self._step_ms)
        if step == self._first_step - 1 and exchange == last:
            return Expected(measurement_tick=step * self._step_ms)
        return NOTHING

    def step(self, state: LocalState, inputs: PlanningInputs) -> tuple[LocalState, PlanningOutputs]:
        """Take in what arrived; plan, or answer the peers' plans, if it is time to."""
        state, request, unusual = self._update(state, inputs)
        if request is not None:
            return self._plan(state, request, inputs.tick, unusual)
        stop = self._stop_without_plan(state, inputs)
        return state, PlanningOutputs(stop_reason=stop, unusual=unusual)

    def problem_of(self, state: LocalState, inputs: PlanningInputs) -> SolvedQp | None:
        state, request, _ = self._update(state, inputs)
        return request and self._planner.problem_of(state.planner, *request[1:])

    def is_whole(self, state: LocalState, tick: int) -> bool:
        """Whether its own window is whole, and its peers are heard and do not slow down."""
        own, T_ini = state.own, self._config.planner.T_ini
        if not own or tick - own[-1].tick >= SAMPLE_MS or not is_gapless(own, T_ini, own[-1].tick):
            return False
        return self._neighbours.are_ready(state.peers, tick)

    def _place(self, tick: int) -> tuple[int, int, int]:
        """Planning step and exchange that a tick lies in, and how far, ms."""
        step, rest = divmod(tick, self._step_ms)
        return step, *divmod(rest, self._exchange_ms)

    def _update(
        self, state: LocalState, inputs: PlanningInputs
    ) -> tuple[LocalState, _Request | None, tuple[str, ...]]:
        """The state with all that has arrived, what the planner is asked now, and counters."""
        unusual, peers = tuple[str, ...](), state.peers
        if inputs.plans or inputs.measurements:
            came = inputs.measurements, inputs.plans
            state = replace(state, peers=self._neighbours.remember(peers, inputs.tick, *came))
            unusual = (REFUSED,) * (state.peers.refused - peers.refused)
        if inputs.measurement is not None:
            own = (*state.own, inputs.measurement)[-self._config.planner.T_ini :]
            state = replace(state, own=own)
        if inputs.mode.name != WALK:
            return state, None, unusual
        step, exchange, off = self._place(inputs.tick)
        if off == exchange == 0 and step >= self._first_step:
            if is_gapless(state.own, self._config.planner.T_ini, inputs.tick):
                end = step if brings_forward(self._config) else step - 1
                terms = self._terms(state, step, inputs, last=step - 1, end=end)
                now = build_planner_inputs(
                    self._config, step, inputs.tick, state.own, inputs.references
                )
                return replace(state, inputs=now), ((step, 0), now, terms), unusual
            unusual = (WINDOW_GAP, *unusual)
        past = state.inputs
        if off == 0 and 1 <= exchange <= self._config.planner.exchanges and past is not None:
            # Skipped if some of the peers' are late.
            asked = step, exchange - 1
            if past.step == step and self._neighbours.is_complete(state.peers, asked):
                terms = self._terms(state, step, inputs, last=step, end=step)
                return state, ((step, exchange), past, terms), unusual
        return state, None, unusual

    def _terms(
        self, state: LocalState, step: int, inputs: PlanningInputs, *, last: int, end: int
    ) -> PeerTerms:
        """Of what peers sent up to the step `last`, with windows that end at the step `end`."""
        first = max(self._first_step, -(-inputs.mode.since // self._step_ms))
        peers = self._neighbours.select(state.peers, last, first, end)
        # The base of samples to come is the command of `last`, whenever this is computed.
        now = last * self._step_ms
        base = base_of_window(self._config, end * self._step_ms, inputs.references, now)
        return self._coupling.terms(peers, step, end, base)

    def _plan(
        self, state: LocalState, request: _Request, tick: int, unusual: tuple[str, ...]
    ) -> tuple[LocalState, PlanningOutputs]:
        """Solve what is asked; what is applied, followed and published of it depends on trust."""
        (step, exchange), own, terms = request
        begun = self._clock_ns()
        planner, result = self._planner.step(state.planner, own, terms)
        took = None if terms.lost else self._clock_ns() - begun
        share = trust_scaling(self._config.planner, own.y_ini[-1] - own.y_des[0])
        faded = result.status == SOLVED and share < 1.0
        # Outputs under nominal forces alone are not followed: nobody wants the robot to do that.
        followed = own.y_des if result.status != SOLVED else result.y
        if faded:
            followed = own.y_des + share * (result.y - own.y_des)
        plan_tick = step * self._step_ms
        # Peers are told what is applied.
        plan = Plan(
            plan_tick,
            plan_tick * 1_000_000,
            step,
            result.u - (1.0 - share) * result.du,
            result.y_nominal + share * (result.y - result.y_nominal),
            FADED if faded else result.status,
            terms.used,
            exchange,
        )
        start, behind = tick + self._config.planner.latency_ms, 0 if exchange else 1  # steps
        outputs = PlanningOutputs(
            plan,
            ActivePlan(start, plan_tick, share * result.du, followed),
            _peer_lost(terms.lost) if terms.lost else "",
            took,
            {f"plan.{p.robot}": float(self._step_ms * (behind + p.age)) for p in terms.peers},
            unusual,
        )
        return replace(state, planner=planner), outputs

    def _stop_without_plan(self, state: LocalState, inputs: PlanningInputs) -> str:
        """Why to stop at a tick without a new plan; "" for no reason.

        Asked at every tick: the one of the planning step may itself be missing.
        """
        step, first = inputs.tick // self._step_ms, first_due_step(self._config, inputs.mode.since)
        age = step - max(state.planner.step, first - 1)
        if inputs.mode.name != WALK or age <= 0:
            return ""
        if lost := self._neighbours.lost_peers(state.peers, step - 1, first):
            return _peer_lost(lost)
        return WINDOW_LOST if age > patience(self._config) else ""


def _peer_lost(names: tuple[str, ...]) -> str:
    return with_detail(PEER_LOST, ",".join(names))
