"""Which planning part an agent has, by the configured kind of planner; its plans are checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

# Named as text by the table of kinds. Imported here too, so that whoever follows imports to find
# what an agent's behaviour depends on finds these.
import quadriga.agents.planning.local
import quadriga.agents.planning.remote  # noqa: F401
from quadriga.agents.gait import step_ms
from quadriga.agents.planner.solver import NOMINAL, SolvedQp
from quadriga.agents.planner.team import Collected
from quadriga.agents.planning.active_plan import ActivePlan, PlanCheck, add_plan
from quadriga.agents.planning.interface import (
    Expected,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.planning.references import reference_at
from quadriga.agents.predictor.episode import commanded_outputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Plan
from quadriga.shared.modes import WALK
from quadriga.shared.planner_kinds import find_kind, load_builder
from quadriga.shared.runtime.record import record


class NominalPlanning(PlanningInterface[None]):
    """No planning at all: the robot walks on nominal forces and follows the operator."""

    def __init__(self, *_: object) -> None: ...

    def initial(self) -> None:
        """No state."""

    def step(self, state: None, inputs: PlanningInputs) -> tuple[None, PlanningOutputs]:
        """No deviation from nominal forces."""
        return None, PlanningOutputs()


@record
class PlanningState:
    """What an agent remembers of its planning.

    Attributes:
        planner: the planner's own state.
        plans: those in force or waiting for their start.
    """

    planner: Any
    plans: tuple[ActivePlan, ...] = ()


class CheckedPlanning(PlanningInterface[PlanningState]):
    """A planner of any kind; no plan of its is followed or published that cannot be meant.

    In the place of one that cannot be come nominal forces and the desired outputs, with a status
    that names the planner and the reason.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
        planner: whose plans these are.
    """

    def __init__(self, config: Config, index: int, planner: PlanningInterface[Any]) -> None:
        self._config, self._planner, self._check = config, planner, PlanCheck(config, index)

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements it takes in."""
        return self._planner.peers

    def initial(self) -> PlanningState:
        """The planner's state before the first tick, and no plan."""
        return PlanningState(self._planner.initial())

    def expected(self, tick: int) -> Expected:
        """What lock-step waits for before the step of `tick`."""
        return self._planner.expected(tick)

    def step(
        self, state: PlanningState, inputs: PlanningInputs
    ) -> tuple[PlanningState, PlanningOutputs]:
        """Step the planner, and take its plan into force; a robot that does not walk has none."""
        planner, outputs = self._planner.step(state.planner, inputs)
        plans = state.plans if inputs.mode.name == WALK else ()
        if outputs.plan is not None or outputs.active is not None:
            published, followed, now = outputs.plan, outputs.active, inputs.tick
            fault = "" if published is None else self._check.fault_of(published, now)
            if not fault and followed is not None:
                fault = self._check.fault_of_active(followed, now)
            if fault:
                outputs = self._refuse(outputs, inputs, fault)
            if outputs.active is not None:
                plans = add_plan(plans, outputs.active)
        return PlanningState(planner, plans), outputs

    def is_whole(self, state: PlanningState, tick: int) -> bool:
        """Whether all that planning takes in is there, of a robot that stands for lack of it."""
        return self._planner.is_whole(state.planner, tick)

    def problem_of(self, state: PlanningState, inputs: PlanningInputs) -> SolvedQp | None:
        """The QP that `step` solves for these arguments; None if it solves none."""
        return self._planner.problem_of(state.planner, inputs)

    def _refuse(
        self, outputs: PlanningOutputs, inputs: PlanningInputs, fault: str
    ) -> PlanningOutputs:
        """Nominal forces from now on, published if the planner's plan was to be."""
        kind, step = self._config.planner.kind, inputs.tick // step_ms(self._config)
        tick, height = step * step_ms(self._config), self._config.reference.height
        u, plan = self._check.nominal(tick), outputs.plan
        reference, _ = reference_at(inputs.references, inputs.tick, height)
        y = np.tile(commanded_outputs(reference), (len(u), 1))
        if plan is not None:
            status = with_detail(NOMINAL, f"plan of {kind} refused: {fault}")
            plan = Plan(tick, tick * 1_000_000, step, u, y, status, plan.used, plan.exchange)
        active = ActivePlan(inputs.tick, tick, np.zeros_like(u), y)
        unusual = (*outputs.unusual, f"refused_plan_of_{kind}")
        return replace(outputs, plan=plan, active=active, unusual=unusual)


def build_planning(
    config: Config,
    index: int,
    predictor: Predictor | None,
    clock_ns: Callable[[], int],
    collected: Collected | None = None,
) -> CheckedPlanning:
    """The planning part of one agent.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
        predictor: the fitted predictor; None: an agent that would plan with one does not plan.
        clock_ns: read around the planner for telemetry.
        collected: reads the collected episodes, for a kind whose agents plan with them.

    Raises:
        ConfigError: the kind of planner is not installed, or cannot be imported.
    """
    kind = find_kind(config.planner.kind)
    planner: PlanningInterface[Any] = NominalPlanning()
    if predictor is not None or not kind.agents_predict:
        data = (collected,) if kind.needs_data and not kind.central else ()
        planner = load_builder(kind, kind.build)(config, index, predictor, clock_ns, *data)
    return CheckedPlanning(config, index, planner)
