"""Which planning part an agent has, by the configured kind of planner."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

# Named as text by the table of kinds. Imported here too, so that whoever follows imports to find
# what an agent's behaviour depends on finds these.
import quadriga.agents.planning.local
import quadriga.agents.planning.remote  # noqa: F401
from quadriga.agents.planning.interface import PlanningInterface
from quadriga.agents.planning.nominal import NominalPlanning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind, load_builder


def build_planning(
    config: Config, index: int, predictor: Predictor | None, clock_ns: Callable[[], int]
) -> PlanningInterface[Any]:
    """The planning part of one agent.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
        predictor: the fitted predictor; None: an agent that would plan with one does not plan.
        clock_ns: read around the planner for telemetry.

    Raises:
        ConfigError: the kind of planner is not installed, or cannot be imported.
    """
    kind = find_kind(config.planner.kind)
    if kind.agents_predict and predictor is None:
        return NominalPlanning()
    planning: PlanningInterface[Any] = load_builder(kind, kind.build)(
        config, index, predictor, clock_ns
    )
    return planning
