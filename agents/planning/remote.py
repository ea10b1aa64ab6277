"""The agent whose plans are made elsewhere: it takes them as they come, and stops without them."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.gait import nominal_forces
from quadriga.agents.modes import WALK
from quadriga.agents.planning.active_plan import ActivePlan, fading, launched, present
from quadriga.agents.planning.interface import (
    NOTHING,
    Expected,
    PlanningInputs,
    PlanningOutputs,
    PlanningState,
)
from quadriga.agents.planning.local import FADED, REFUSED, first_step
from quadriga.agents.planning.operator_references import in_force
from quadriga.agents.predictor.episode import commanded_outputs
from quadriga.agents.time_grid import horizon_stance, step_ms
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import N_LEGS, Array
from quadriga.shared.wire.messages import Plan
from quadriga.shared.wire.topics import SAMPLE_MS

LOST: Final = "planner-lost"
# A planner's own plans keep to deviation_max: the share and N on top are for its solver.
# With forces far beyond it a single message would drive all joints to their limits.
_SHARE: Final = 1.5
_MARGIN: Final = 1.0  # N
_FARTHEST: Final = 10.0  # m, m/s, rad, rad/s: no trunk gets there, whatever is predicted


class RemotePlanning:
    """Fixed data of an agent that follows a central planner.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
    """

    def __init__(self, config: Config, index: int) -> None:
        self._config, self._index = config, index
        self._step_ms, self._latency = step_ms(config), central_latency(config)
        self._first_step = first_step(config)
        self._most = _SHARE * np.tile(config.planner.deviation_max, N_LEGS) + _MARGIN  # (12,), N

    @property
    def peers(self) -> tuple[str, ...]:
        """None: the central planner knows them."""
        return ()

    def awaited(self, tick: int) -> Expected:
        """The plan of a step, the configured latency after its data."""
        step, rest = divmod(tick - self._latency, self._step_ms)
        due = rest == 0 and step >= self._first_step
        return Expected(plan=(step, 0)) if due else NOTHING

    def step(
        self, state: PlanningState, heard: PlanningInputs
    ) -> tuple[PlanningState, PlanningOutputs]:
        """Take the newest plan into force; say what to apply now."""
        tick, planner = heard.tick, self._config.planner
        if heard.measurement is not None:
            state = replace(state, own=(heard.measurement,))
        unusual: list[str] = []
        for _, plan in heard.plans:
            if not self._usable(plan, tick):
                unusual.append(REFUSED)
            elif state.newest < plan.serial:
                state, factor = self._take(state, plan, heard)
                unusual += [f"plan_{FADED}"] if factor < 1.0 else []
        if heard.mode.name != WALK:
            return state, PlanningOutputs(unusual=tuple(unusual))
        due = (tick - self._latency) // self._step_ms
        age = due - max(state.newest[0], self._first_step - 1)
        planned = self._step_ms * state.newest[0]
        lost = age > planner.max_peer_age + planner.hold_steps
        return state, PlanningOutputs(
            present=present(state.flights, tick),
            stop_reason=LOST if lost else "",
            ages_ms={"plan": float(tick - planned)} if planned >= 0 else {},
            unusual=tuple(unusual),
        )

    def _usable(self, plan: Plan, tick: int) -> bool:
        """Whether a plan is one of this team's at this time: else it is foreign, or forged."""
        samples = self._config.planner.N
        begun = plan.tick == plan.step * self._step_ms
        timely = begun and 0 <= tick - plan.tick < SAMPLE_MS * samples
        return timely and len(plan.u) == samples and self._plausible(plan)

    def _plausible(self, plan: Plan) -> bool:
        """Whether forces and outputs are such as a planner of this configuration may plan."""
        possible = np.abs(self._deviation(plan)) <= self._most
        return bool(possible.all() and (np.abs(plan.y) <= _FARTHEST).all())

    def _deviation(self, plan: Plan) -> Array:
        """What a plan adds to the nominal forces. Shape (N, 12), N."""
        du: Array = plan.u - nominal_forces(horizon_stance(self._config, self._index, plan.step))
        return du

    def _take(
        self, state: PlanningState, plan: Plan, heard: PlanningInputs
    ) -> tuple[PlanningState, float]:
        """Take a plan into force; with the share of it that is applied."""
        factor, outputs = 1.0, plan.y
        if state.own:
            now, _ = in_force(heard.references, heard.tick, self._config.reference.height)
            asked = commanded_outputs(now)
            factor = fading(self._config.planner, state.own[0].y - asked)
            # What the outputs come to without the plan's forces is not in the plan: the speeds of
            # one that fades out give way to those asked for.
            outputs = asked + factor * (plan.y - asked)
        flight = ActivePlan(heard.tick, plan.tick, factor * self._deviation(plan), outputs)
        state = replace(state, flights=launched(state.flights, flight), newest=plan.serial)
        return state, factor


def central_latency(config: Config) -> int:
    """Ticks from the data of a central plan to its start; at least one for the way there."""
    return max(1, config.planner.latency_ms)
