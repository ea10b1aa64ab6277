"""The agent that plans for itself: when it plans, with what of its peers, when it plans again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.modes import WALK
from quadriga.agents.planner.neighbours import Neighbours, PeerMemory
from quadriga.agents.planner.peer_terms import PeerTerms
from quadriga.agents.planner.planner import PEER_LOST, Planner, PlannerInputs, PlanResult
from quadriga.agents.planner.qp_solver import SOLVED
from quadriga.agents.planning.active_plan import ActivePlan, fading, launched, present
from quadriga.agents.planning.adaptation import Adapter
from quadriga.agents.planning.interface import (
    NOTHING,
    Expected,
    PlanningInputs,
    PlanningOutputs,
    PlanningState,
)
from quadriga.agents.planning.operator_references import base_of_samples, base_of_window, in_force
from quadriga.agents.predictor.episode import commanded_outputs, output_base
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.recursive import Correction
from quadriga.agents.time_grid import exchange_ms, patience, step_ms
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import Array
from quadriga.shared.wire.messages import Measurement, Plan, Reference
from quadriga.shared.wire.topics import SAMPLE_MS

FADED: Final = "faded"
WINDOW_LOST: Final = "window-lost"  # stop: no plan of its own for as long as a peer may be silent
WINDOW_GAP: Final = "window_gap"  # counted: no plan, for a sample of the robot's own is missing
REFUSED: Final = "refused_by_planner"  # counted: a peer's message that cannot be meant
UNLEARNT: Final = "window_not_learnt"  # counted: a window that an agent that adapts refused
ALONE: Final = "decentralised"


class LocalPlanning:
    """Fixed data of an agent's own planning; `step` is a function of its arguments alone.

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
        self._neighbours = Neighbours(config, index, _peers(config, index, predictor))
        self._planner = Planner(config, index, predictor)
        self._first_step = first_step(config)
        self._adapter = None
        if config.planner.adaptation == "recursive":
            self._adapter = Adapter(config, index, predictor)
        self._kept = config.planner.T_ini if self._adapter is None else self._adapter.samples

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements it takes in."""
        return self._neighbours.names

    def awaited(self, tick: int) -> Expected:
        """The peers' plans of this step, some time after they were made; see `exchange_ms`."""
        step, rest = divmod(tick, self._step_ms)
        turn, off = divmod(rest, self._exchange_ms)
        exchanges = self._config.planner.exchanges
        if off or not 1 <= turn <= exchanges + 1 or not self.peers:
            return NOTHING
        if step < self._first_step:
            before = step == self._first_step - 1 and turn == exchanges + 1
            return Expected(measurement_tick=step * self._step_ms if before else None)
        return Expected((step, turn - 1), step * self._step_ms)

    def step(
        self, state: PlanningState, heard: PlanningInputs
    ) -> tuple[PlanningState, PlanningOutputs]:
        """Take in what arrived; plan, or answer the peers' plans, if it is time to."""
        tick = heard.tick
        memory = state.memory or self._neighbours.initial()
        unusual: tuple[str, ...] = ()
        news = bool(heard.plans or heard.measurements)
        if news:
            before = memory.refused
            memory = self._neighbours.remember(memory, tick, heard.measurements, heard.plans)
            unusual = (REFUSED,) * (memory.refused - before)
        own = state.own
        if heard.measurement is not None:
            own = (*own, heard.measurement)[-self._kept :]
        if own is not state.own or memory is not state.memory:
            state = replace(state, own=own, memory=memory)
        if heard.mode.name != WALK:
            return state, PlanningOutputs(unusual=unusual)
        state, planned = self._planned(state, memory, heard, news)
        if planned.plan is None and (gone := self._gone(state, memory, heard)):
            planned = replace(planned, stop_reason=gone)
        return state, replace(planned, unusual=(*planned.unusual, *unusual)) if unusual else planned

    def _planned(
        self, state: PlanningState, memory: PeerMemory, heard: PlanningInputs, news: bool
    ) -> tuple[PlanningState, PlanningOutputs]:
        tick = heard.tick
        unusual: tuple[str, ...] = ()
        step, rest = divmod(tick, self._step_ms)
        if rest == 0 and step >= self._first_step:
            if self._window_complete(state, tick):
                return self._plan(state, memory, step, heard)
            unusual = (WINDOW_GAP,)
        turn, off = divmod(rest, self._exchange_ms)
        if off == 0 and 1 <= turn <= self._config.planner.exchanges:
            return self._answer(state, memory, (step, turn), heard)
        if news and state.terms_for != step + 1:
            state = self._prepare(state, memory, step + 1, heard.references)
        return state, PlanningOutputs(present=present(state.flights, tick), unusual=unusual)

    def _gone(self, state: PlanningState, memory: PeerMemory, heard: PlanningInputs) -> str:
        """Why to stop although there is no plan of this step that would tell; "" for no reason.

        Asked at every tick: the one of the planning step may itself be missing.
        """
        step = heard.tick // self._step_ms
        first, since = self._first_step, heard.mode.since
        if since > self._config.gait.stand_ms:
            # Who begins in the midst of a walk owes and is owed nothing till its window is whole.
            first = max(first, first_step(self._config, since))
        age = step - max(state.newest[0], first - 1)
        if age <= 0:
            return ""
        lost = self._neighbours.lost(memory, step - 1, first)
        if lost:
            return _peer_lost(lost)
        return WINDOW_LOST if age > patience(self._config) else ""

    def _window_complete(self, state: PlanningState, tick: int) -> bool:
        return _gapless(state.own, self._config.planner.T_ini, tick)

    def _prepare(
        self, state: PlanningState, memory: PeerMemory, step: int, references: tuple[Reference, ...]
    ) -> PlanningState:
        """The peers' terms of the coming step, as soon as all they need is there."""
        last = step - 1, self._config.planner.exchanges
        if not self._neighbours.complete(memory, last):
            return state
        terms = self._terms(state, memory, step, references)
        return replace(state, terms=terms, terms_for=step)

    def _terms(
        self, state: PlanningState, memory: PeerMemory, step: int, references: tuple[Reference, ...]
    ) -> PeerTerms:
        end = step if self._config.planner.compensation else step - 1
        chosen = self._neighbours.select(memory, step - 1, self._first_step, window_step=end)
        # The base of samples to come is the command of now, whenever this is computed.
        now = (step - 1) * self._step_ms
        base = base_of_window(self._config, end * self._step_ms, references, now)
        return self._planner.peer_terms(state.terms, chosen, step, base)

    def _plan(
        self, state: PlanningState, memory: PeerMemory, step: int, heard: PlanningInputs
    ) -> tuple[PlanningState, PlanningOutputs]:
        terms = state.terms
        if state.terms_for != step:
            terms = self._terms(state, memory, step, heard.references)
        inputs = self._planner_inputs(state, step, heard)
        learned = self._learn(state, heard)
        unlearnt = _refused(learned) > _refused(state.learned)
        state = replace(state, terms=terms, terms_for=step, inputs=inputs, learned=learned)
        state, planned = self._solve(state, inputs, terms, (step, 0), heard)
        return state, replace(planned, unusual=(UNLEARNT,)) if unlearnt else planned

    def _learn(self, state: PlanningState, heard: PlanningInputs) -> Correction | None:
        """What the newest window tells of the plant, if the agent adapts and it is whole."""
        adapter = self._adapter
        if adapter is None or not _gapless(state.own, adapter.samples, heard.tick):
            return state.learned
        y_base = base_of_samples(self._config, heard.tick, adapter.samples, heard.references)
        return adapter.learn(state.learned, state.own, y_base)

    def _own_block(self, learned: Correction | None, step: int) -> Array | None:
        """The corrected G_ii; None where there is nothing to correct, or the result no number."""
        if self._adapter is None or learned is None:
            return None
        G_ii = self._adapter.block(learned, self._planner.phase(step))
        return G_ii if np.isfinite(G_ii).all() else None

    def _answer(
        self,
        state: PlanningState,
        memory: PeerMemory,
        serial: tuple[int, int],
        heard: PlanningInputs,
    ) -> tuple[PlanningState, PlanningOutputs]:
        """Plan the present step again with the peers' plans of it; skipped if some are late."""
        step, turn = serial
        inputs = state.inputs
        made = inputs is not None and inputs.step == step
        if inputs is None or not made or not self._neighbours.complete(memory, (step, turn - 1)):
            return state, self._present(state, heard.tick, PlanningOutputs())
        chosen = self._neighbours.select(memory, step, self._first_step)
        base = base_of_window(self._config, step * self._step_ms, heard.references)
        terms = self._planner.peer_terms(state.terms, chosen, step, base)
        return self._solve(state, inputs, terms, serial, heard)

    def _solve(
        self,
        state: PlanningState,
        inputs: PlannerInputs,
        terms: PeerTerms,
        serial: tuple[int, int],
        heard: PlanningInputs,
    ) -> tuple[PlanningState, PlanningOutputs]:
        planner, tick = self._config.planner, heard.tick
        begun = self._clock_ns()
        G_ii = self._own_block(state.learned, inputs.step)
        remembered, result = self._planner.step(state.planner, inputs, terms, G_ii)
        took = self._clock_ns() - begun if remembered.solves > state.planner.solves else None
        factor = fading(planner, inputs.y_ini[-1] - inputs.y_des[0])
        plan_tick = inputs.step * self._step_ms
        plan = faded_plan(result, factor, serial, plan_tick)
        outputs = _tracked(result, factor, inputs.y_des)
        flight = ActivePlan(tick + planner.latency_ms, plan_tick, factor * result.du, outputs)
        state = replace(
            state, planner=remembered, flights=launched(state.flights, flight), newest=serial
        )
        behind = 0 if serial[1] else 1
        planned = PlanningOutputs(
            plan,
            stop_reason=_peer_lost(result.lost) if result.lost else "",
            planner_ns=took,
            ages_ms={
                f"plan.{peer}": float(self._step_ms * (behind + age))
                for peer, age in terms.ages.items()
            },
        )
        return state, self._present(state, tick, planned)

    def _planner_inputs(
        self, state: PlanningState, step: int, heard: PlanningInputs
    ) -> PlannerInputs:
        now, _ = in_force(heard.references, heard.tick, self._config.reference.height)
        N, own = self._config.planner.N, state.own[-self._config.planner.T_ini :]
        return PlannerInputs(
            step=step,
            u_ini=np.array([sample.u for sample in own]),
            y_ini=np.array([sample.y for sample in own]),
            stance_ini=np.array([sample.stance for sample in own]) > 0.5,
            y_base_ini=base_of_window(self._config, heard.tick, heard.references),
            y_base=np.tile(output_base(self._config.planner.interface, now), (N, 1)),
            y_des=np.tile(commanded_outputs(now), (N, 1)),
        )

    def _present(
        self, state: PlanningState, tick: int, planned: PlanningOutputs
    ) -> PlanningOutputs:
        return replace(planned, present=present(state.flights, tick))


def _peer_lost(names: tuple[str, ...]) -> str:
    return f"{PEER_LOST}:{','.join(names)}"


def _refused(learned: Correction | None) -> int:
    return 0 if learned is None else learned.refused


def _gapless(own: tuple[Measurement, ...], count: int, tick: int) -> bool:
    """Whether the last `count` samples up to the tick `tick` are there."""
    return len(own) >= count and own[-count].tick == tick - SAMPLE_MS * (count - 1)


def first_step(config: Config, begun: int = 0) -> int:
    """The team's first planning step: once it walks and all windows can be complete.

    Args:
        config: the team's configuration.
        begun: tick of the first sample's beginning.
    """
    samples = config.planner.T_ini + config.planner.applied
    ready_ms = max(config.gait.stand_ms, begun + SAMPLE_MS * samples)
    return -(-ready_ms // step_ms(config))


def _peers(config: Config, index: int, predictor: Predictor) -> frozenset[int]:
    """Places of the robots whose plans matter to this agent."""
    if config.planner.kind == ALONE:
        return frozenset()
    others = frozenset(range(config.team.robots)) - {index}
    if predictor.meta.neighbours == "all":
        return others
    return frozenset(j for j in others if predictor.G[:, index, j].any())


def _tracked(result: PlanResult, factor: float, y_des: Array) -> Array:
    """The outputs to follow, (N, 6): where the plan gives way, what is asked for takes over.

    Not what comes of nominal forces alone, which no one wants; that is for the peers to know.
    """
    if result.status != SOLVED:
        return y_des
    return result.y if factor == 1.0 else y_des + factor * (result.y - y_des)


def faded_plan(result: PlanResult, factor: float, serial: tuple[int, int], tick: int) -> Plan:
    """The plan as published: what is applied is what the peers are told."""
    status = FADED if result.status == SOLVED and factor < 1.0 else result.status
    u = result.u - (1.0 - factor) * result.du
    y = result.y_nominal + factor * (result.y - result.y_nominal)
    step, exchange = serial
    return Plan(tick, tick * 1_000_000, step, u, y, status, result.used, exchange)
