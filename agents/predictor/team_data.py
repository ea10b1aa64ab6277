"""What a fit takes of a team's episodes: scaled signals and their regressions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.regression import Regression, normal_equations
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


def scaled_signals(episodes: Sequence[Episode], meta: PredictorMeta) -> list[Array]:
    """Scaled deviations of every episode, [u of all; y of all], shape (T, 18 n).

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    check_episodes(episodes, meta)
    return [np.concatenate(episode.scaled_deviations(), axis=1) for episode in episodes]


def team_regression(episodes: Sequence[Episode], meta: PredictorMeta) -> Regression:
    """The regression over all windows of all episodes.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    return normal_equations(scaled_signals(episodes, meta), meta.layout)


def check_episodes(episodes: Sequence[Episode], meta: PredictorMeta) -> None:
    """Refuse data that no fit for `meta` can use.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    if not episodes:
        raise PredictorError("episodes", "none", "at least one", "did every walk end in a fall?")
    for episode in episodes:
        if episode.robots != meta.robots:
            raise PredictorError(
                "episode", f"{episode.robots} robots", f"{meta.robots}", "data of another team"
            )
        if episode.samples < meta.T_ini + meta.N:
            raise PredictorError(
                "episode",
                f"{episode.samples} samples",
                f"at least {meta.T_ini + meta.N}",
                "cut short by a fall",
            )
