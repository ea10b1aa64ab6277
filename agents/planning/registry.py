"""Which planning part an agent has, by the configured kind of planner."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from quadriga.agents.planning.interface import PlanningInterface
from quadriga.agents.planning.local import LocalPlanning
from quadriga.agents.planning.nominal import NominalPlanning
from quadriga.agents.planning.remote import RemotePlanning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import CENTRAL, Config


def build_planning(
    config: Config, index: int, predictor: Predictor | None, clock_ns: Callable[[], int]
) -> PlanningInterface[Any]:
    """The planning part of one agent.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
        predictor: the fitted predictor; None: the agent does not plan itself.
        clock_ns: read around the planner for telemetry.
    """
    if config.planner.kind in CENTRAL:
        return RemotePlanning(config, index)
    if predictor is not None:
        return LocalPlanning(config, index, predictor, clock_ns)
    return NominalPlanning()
