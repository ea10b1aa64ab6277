"""The planner of the whole team, from a predictor or from the collected data themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from quadriga.agents.planner.deepc_qp import build_model
from quadriga.agents.planner.team_planner import TeamPlanner, build_centralised, build_deepc
from quadriga.agents.predictor.deepc import reduce
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.cache import data_path
from quadriga.identification.dataset import read_data
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.blas import use_one_blas_thread


def build_central_planner(
    config: Config, predictor: Predictor, data: Path | None = None
) -> TeamPlanner:
    """The planner of the whole team for a `planner.kind` that is one process for all.

    `data` is the file of what was collected, which DeePC plans with; None takes the cache's.

    Raises:
        PredictorError: the predictor is of another team; there are no collected data for DeePC.
    """
    use_one_blas_thread()
    return choose_central_planner(
        config, predictor, lambda: read_data(data or data_path(config)).training
    )


def choose_central_planner(
    config: Config, predictor: Predictor, collected: Callable[[], Sequence[Episode]]
) -> TeamPlanner:
    """The same with the episodes that DeePC plans with, which no other planner asks for."""
    if config.planner.kind == "centralised":
        return build_centralised(config, predictor)
    planner = config.planner
    reduction = reduce(collected(), planner.T_ini, planner.N)
    return build_deepc(
        config, build_model(reduction, planner, planner.lambda_g, planner.lambda_sigma)
    )
