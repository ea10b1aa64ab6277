"""Which planning part an agent has, by the configured kind of planner."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

# Named as text by the table of kinds. Imported here too, so that whoever follows imports to find
# what an agent's behaviour depends on finds these.
import quadriga.agents.planning.local
import quadriga.agents.planning.remote  # noqa: F401
from quadriga.agents.planner.team import Collected
from quadriga.agents.planning.interface import (
    NEVER_MS,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind, load_builder


class NominalPlanning(PlanningInterface[None]):
    """No planning at all: the robot walks on nominal forces and follows the operator."""

    def __init__(self, *_: object) -> None: ...

    effect_ms = NEVER_MS

    def next_due(self, tick: int) -> int:
        return tick + NEVER_MS

    def initial(self) -> None: ...

    def step(self, state: None, inputs: PlanningInputs) -> tuple[None, PlanningOutputs]:
        return None, PlanningOutputs()


def build_planning(
    config: Config,
    index: int,
    predictor: Predictor | None,
    clock_ns: Callable[[], int],
    collected: Collected | None = None,
) -> PlanningInterface[Any]:
    """The planning part of the agent `index`, 0-based.

    An agent that would plan with a predictor does not plan without one. `clock_ns` is read around
    the planner for telemetry, `collected` the episodes of a kind whose agents plan with them.

    Raises:
        ConfigError: the kind of planner is not installed, or cannot be imported.
    """
    kind = find_kind(config.planner.kind)
    if predictor is None and kind.agents_predict:
        return NominalPlanning()
    data = (collected,) if kind.needs_data and not kind.central else ()
    planner: PlanningInterface[Any] = load_builder(kind, kind.build)(
        config, index, predictor, clock_ns, *data
    )
    return planner
