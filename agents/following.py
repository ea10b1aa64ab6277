"""The agent whose plans are made elsewhere: it takes them as they come, and stops without them."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from agents.flight import Flight, fading, launched, present
from agents.gait import nominal_forces
from agents.modes import WALK
from agents.pilot import Awaited, Heard, PilotState, Planned
from agents.planner.episode import commanded_outputs
from agents.planner.horizon import horizon_stance, step_ms
from agents.planning import first_step
from agents.references import in_force
from shared.config import Config
from shared.messages import Plan

LOST: Final = "planner-lost"


class Follower:
    """Fixed data of an agent that follows a central planner.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
    """

    def __init__(self, config: Config, index: int) -> None:
        self._config, self._index = config, index
        self._step_ms, self._latency = step_ms(config), central_latency(config)
        self._first_step = first_step(config)

    @property
    def peers(self) -> tuple[str, ...]:
        """None: the central planner knows them."""
        return ()

    def awaited(self, tick: int) -> Awaited:
        """The plan of a step, the configured latency after its data."""
        step, rest = divmod(tick - self._latency, self._step_ms)
        due = rest == 0 and step >= self._first_step
        return Awaited(plan=(step, 0) if due else None)

    def step(self, state: PilotState, heard: Heard) -> tuple[PilotState, Planned]:
        """Take the newest plan into force; say what to apply now."""
        tick, planner = heard.tick, self._config.planner
        if heard.measurement is not None:
            state = replace(state, own=(heard.measurement,))
        for _, plan in heard.plans:
            if state.newest < plan.serial and len(plan.u) == planner.N:
                state = self._take(state, plan, heard)
        if heard.mode.name != WALK:
            return state, Planned()
        due = (tick - self._latency) // self._step_ms
        age = due - max(state.newest[0], self._first_step - 1)
        lost = age > planner.max_peer_age + planner.hold_steps
        return state, Planned(
            present=present(state.flights, tick),
            stop_reason=LOST if lost else "",
            ages_ms={"plan": float(tick - self._step_ms * state.newest[0])} if heard.plans else {},
        )

    def _take(self, state: PilotState, plan: Plan, heard: Heard) -> PilotState:
        factor, outputs = 1.0, plan.y
        if state.own:
            now, _ = in_force(heard.references, heard.tick, self._config.reference.height)
            asked = commanded_outputs(now)
            factor = fading(self._config.planner, state.own[0].y - asked)
            # What the outputs come to without the plan's forces is not in the plan: the speeds of
            # one that fades out give way to those asked for.
            outputs = asked + factor * (plan.y - asked)
        du = plan.u - nominal_forces(horizon_stance(self._config, self._index, plan.step))
        flight = Flight(heard.tick, plan.tick, factor * du, outputs)
        return replace(state, flights=launched(state.flights, flight), newest=plan.serial)


def central_latency(config: Config) -> int:
    """Ticks from the data of a central plan to its start; at least one for the way there."""
    return max(1, config.planner.latency_ms)
