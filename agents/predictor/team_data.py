"""What a fit takes of a team's episodes: scaled signals and their regressions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.regression import (
    Regression,
    normal_equations,
    normal_equations_by_part,
)
from quadriga.agents.time_grid import gait_phase
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.topics import SAMPLE_MS


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


def regressions_by_phase(episodes: Sequence[Episode], meta: PredictorMeta) -> Iterator[Regression]:
    """The regression over the windows of each phase of the gait in turn.

    A window's phase is that of the end of its [u_ini; y_ini], where a plan would begin.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    signals = scaled_signals(episodes, meta)
    period = np.lcm(2 * meta.stance_ms, SAMPLE_MS) // SAMPLE_MS
    starts = np.array([e.first_tick + SAMPLE_MS * (meta.T_ini - 1) for e in episodes])
    origin = int(starts[0])
    if ((starts - origin) % SAMPLE_MS).any():
        raise PredictorError(
            "episodes: first_tick",
            f"{sorted({int(s) % SAMPLE_MS for s in starts})} modulo 10 ms",
            "samples on one grid",
        )
    part_of = np.array(
        [
            gait_phase(origin + SAMPLE_MS * k, meta.stand_ms, meta.stance_ms, meta.phases)
            for k in range(period)
        ]
    )
    places = ((starts - origin) // SAMPLE_MS) % period
    yield from normal_equations_by_part(signals, places.tolist(), part_of, meta.layout)


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
