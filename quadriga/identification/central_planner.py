"""The planner of the whole team, from a predictor or from the collected data themselves."""

from __future__ import annotations

from pathlib import Path

from quadriga.agents.planner.team import Collected, TeamPlanner
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.cache import data_path
from quadriga.identification.dataset import read_data
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind, load_builder
from quadriga.shared.runtime.arithmetic import use_one_blas_thread


def build_central_planner(
    config: Config, predictor: Predictor | None, data: Path | None = None
) -> TeamPlanner:
    """The planner of the whole team for a `planner.kind` that is one process for all.

    Args:
        config: the team's configuration.
        predictor: the fitted predictor; None for a kind that needs none.
        data: the file of what was collected, for a kind that needs it; None takes the cache's.

    Raises:
        PredictorError: the predictor is of another team; there are no collected data.
        ConfigError: the kind is not installed, or cannot be imported.
    """
    use_one_blas_thread()
    return choose_central_planner(config, predictor, collected_of(config, data))


def collected_of(config: Config, data: Path | None = None) -> Collected:
    """What reads the collected episodes, from a file or by default from the cache's."""
    return lambda: read_data(data or data_path(config)).training


def choose_central_planner(
    config: Config, predictor: Predictor | None, collected: Collected
) -> TeamPlanner:
    """The same with the collected episodes, which only a kind that needs them asks for."""
    kind = find_kind(config.planner.kind)
    planner: TeamPlanner = load_builder(kind, kind.build_team)(config, predictor, collected)
    return planner
