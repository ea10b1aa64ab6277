"""The agent whose plans are made elsewhere: it takes them as they come, and stops without them."""

from __future__ import annotations

from dataclasses import replace

from quadriga.agents.gait import first_due_step, first_step, patience, step_ms
from quadriga.agents.planning.active_plan import FADED, PlanCheck, trust_scaling
from quadriga.agents.planning.interface import (
    NOTHING,
    REFUSED,
    ActivePlan,
    Expected,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.planning.references import reference_at
from quadriga.agents.predictor.episode import commanded_outputs
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.modes import PLANNER_LOST, WALK
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import SAMPLE_MS


@record
class RemoteState:
    """What an agent remembers that follows a central planner.

    Attributes:
        newest_sample: the agent's own newest sample.
        newest: step and exchange of the newest plan.
    """

    newest_sample: Measurement | None = None
    newest: tuple[int, int] = (-1, 0)


class RemotePlanning(PlanningInterface[RemoteState]):
    """Fixed data of the agent `index`, 0-based, which follows a central planner."""

    def __init__(self, config: Config, index: int, *_: object) -> None:
        self._config, self._check = config, PlanCheck(config, index)
        self._step_ms, self._latency = step_ms(config), central_latency(config)
        self._first_step = first_step(config)

    def next_due(self, tick: int) -> int:
        """When the next plan is due."""
        return tick + self._step_ms - (tick - self._latency) % self._step_ms

    def initial(self) -> RemoteState:
        return RemoteState()

    def expected(self, tick: int) -> Expected:
        """The plan of a step, the configured latency after its data."""
        step, rest = divmod(tick - self._latency, self._step_ms)
        due = rest == 0 and step >= self._first_step
        return Expected(plan=(step, 0)) if due else NOTHING

    def step(
        self, state: RemoteState, inputs: PlanningInputs
    ) -> tuple[RemoteState, PlanningOutputs]:
        """Take the newest plan into force."""
        tick = inputs.tick
        if inputs.measurement is not None:
            state = replace(state, newest_sample=inputs.measurement)
        unusual, active = list[str](), None
        for _, plan in inputs.plans:
            if self._check.fault_of(plan, tick):  # of another team or time, or forged
                unusual.append(REFUSED)
            elif state.newest < plan.serial:
                state = replace(state, newest=plan.serial)
                active, share = self._follow(state, plan, inputs)
                unusual += [f"plan_{FADED}"] if share < 1.0 else []
        if inputs.mode.name != WALK:
            return state, PlanningOutputs(unusual=tuple(unusual))
        newest_step, due = state.newest[0], (tick - self._latency) // self._step_ms
        age = due - max(newest_step, first_due_step(self._config, inputs.mode.since) - 1)
        stop = PLANNER_LOST if age > patience(self._config) else ""
        ages = {"plan": float(tick - self._step_ms * newest_step)} if newest_step >= 0 else {}
        return state, PlanningOutputs(None, active, stop, None, ages, tuple(unusual))

    def is_whole(self, state: RemoteState, tick: int) -> bool:
        """Whether its own samples come; the planner does not plan while robots stand."""
        sample = state.newest_sample
        return sample is not None and tick - sample.tick < SAMPLE_MS

    def _follow(
        self, state: RemoteState, plan: Plan, inputs: PlanningInputs
    ) -> tuple[ActivePlan, float]:
        """What is applied of a plan, and the share of its forces that is."""
        share, outputs = 1.0, plan.y
        if state.newest_sample is not None:
            now, _ = reference_at(inputs.references, inputs.tick, self._config.reference.height)
            y_des = commanded_outputs(now)
            share = trust_scaling(self._config.planner, state.newest_sample.y - y_des)
            # The plan does not tell the outputs without its forces: as it fades out, the desired
            # speeds take over.
            outputs = y_des + share * (plan.y - y_des)
        du = plan.u - self._check.nominal(plan.tick)
        return ActivePlan(inputs.tick, plan.tick, share * du, outputs), share


def central_latency(config: Config) -> int:
    """Ticks from the data of a central plan to its start; at least one for the way there."""
    return max(1, config.planner.latency_ms)
