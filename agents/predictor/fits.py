"""The fits of a team's G by name, all on scaled deviations of its episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.agents.predictor.episode import Y_SCALE, Episode, wrench_map
from quadriga.agents.predictor.measured_response import fit_measured_response, read_pulse_responses
from quadriga.agents.predictor.periodic import (
    Walked,
    draw_starts,
    estimate_response,
    fit_factors,
    held_samples,
)
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.regression import Penalty, fit_blocks
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import SAMPLE_MS

_COMMANDED: Final = (1, 2, 5)  # vx, vy, wz: outputs whose base moves with the reference

Fit = Callable[[Sequence[Episode], PredictorMeta], Predictor]


def fit(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """The fit that `meta.kind` names.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    return FITS[meta.kind](episodes, meta)


def fit_pinv(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """G = Y_f [U_p; Y_p; U_f]† (eq. 6), through the Gram matrix.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    return _fit_one(episodes, replace(meta, kind="pinv", phases=1, ridge=0.0, block_weight=1.0))


def fit_ridge(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """Block-weighted ridge regression of G; with w = 1 the plain one.

    Row i minimises ‖Y_f^i − Σ_j G_ij Z_j‖² + ridge · M · (‖G_ii‖² + w² Σ_{j≠i} ‖G_ij‖²) with M
    columns: effects that the data do not clearly show are not attributed to the peers. Without this
    weight the agents' best responses to each other's last plans diverge.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    return _fit_one(episodes, replace(meta, kind="ridge", phases=1))


def _fit_one(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    check_episodes(episodes, meta)
    signals = [np.concatenate(episode.scaled_deviations(), axis=1) for episode in episodes]
    penalty = Penalty(meta.ridge, meta.block_weight)
    return Predictor(meta, *fit_blocks(meta.kind, signals, meta.layout, penalty))


def fit_periodic(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """G as a function of the gait's phase, causal, with peers by their net wrench; see `periodic`.

    If there is a file of measured responses, these stand for fitted ones.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
        PredictorFileError: the file of measured responses cannot be read, or is another team's.
    """
    check_episodes(episodes, meta)
    walks, hold = scale_episodes(episodes, meta)
    if meta.response:
        h = fit_measured_response(read_pulse_responses(Path(meta.response)), meta)
    else:
        step = float(np.diff(phase_angles(meta, 0, 2))[0] % (2.0 * np.pi))
        h = estimate_response(walks, hold, meta.layout, step)
    factors = fit_factors(walks, h, meta.layout, wrench_map(meta.robot))
    phases = max(1, 2 * meta.stance_ms // SAMPLE_MS)
    return Predictor(replace(meta, kind="periodic", phases=phases), factors)


FITS: Final[Mapping[str, Fit]] = {"pinv": fit_pinv, "ridge": fit_ridge, "periodic": fit_periodic}


def scale_episodes(
    episodes: Sequence[Episode], meta: PredictorMeta
) -> tuple[tuple[Walked, ...], int]:
    """The episodes scaled, by net wrenches, and for how many samples their forces are held."""
    hold = held_samples([episode.deviations()[0] for episode in episodes])
    walked = []
    for episode in episodes:
        du, dy = episode.deviations()
        base = (episode.y_base / Y_SCALE)[..., list(_COMMANDED)]
        angle = phase_angles(meta, episode.first_tick, episode.samples)
        w = du @ wrench_map(meta.robot).T
        walked.append(Walked(w, dy / Y_SCALE, base, angle, draw_starts(du, hold)))
    return tuple(walked), hold


def phase_angles(meta: PredictorMeta, first_tick: int, count: int) -> Array:
    """Angle of the gait's phase at the starts of samples, the first of which ends at `first_tick`.

    Shape (count,), rad; 0 where the gait begins (`PredictorMeta.stand_ms`).
    """
    starts = first_tick + SAMPLE_MS * (np.arange(count) - 1) - meta.stand_ms
    period = 2 * meta.stance_ms
    angles: Array = 2.0 * np.pi * (starts % period) / period
    return angles


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
