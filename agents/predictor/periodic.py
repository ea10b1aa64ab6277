"""The periodic fit: G as a function of the gait's phase, causal, with peers by their net wrench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.measured_response import fit_measured_response, read_pulse_responses
from quadriga.agents.predictor.periodic_basis import N_WRENCH, phase_angles, wrench_map
from quadriga.agents.predictor.periodic_data import Walked, scale_episodes
from quadriga.agents.predictor.periodic_free import fit_free
from quadriga.agents.predictor.periodic_predictor import PeriodicFactors, PeriodicPredictor
from quadriga.agents.predictor.periodic_response import solve_lags, spread_over_samples, sum_folds
from quadriga.agents.predictor.periodic_shrinkage import shrink
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.regression import check_episodes
from quadriga.agents.predictor.ridge import members_of
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.topics import SAMPLE_MS

_LEAST_FOLDS = 3


def fit_periodic(episodes: Sequence[Episode], meta: PredictorMeta) -> PeriodicPredictor:
    """Responses to wrenches by local projections, shrunk, then what follows from the past.

    See `periodic_response`, `periodic_shrinkage` and `periodic_free`. If there is a file of
    measured responses, these stand for the projections.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
        PredictorFileError: the file of measured responses cannot be read, or is another team's.
    """
    check_episodes(episodes, meta)
    walks, hold = scale_episodes(episodes, meta)
    if meta.response:
        h = fit_measured_response(read_pulse_responses(Path(meta.response)), meta)
    else:
        h = estimate_response(walks, hold, meta)
    n = meta.robots
    peers = np.array([[j in members_of(meta, i) for j in range(n)] for i in range(n)])
    free = fit_free(walks, h, meta.T_ini, peers)
    factors = PeriodicFactors(h * Y_SCALE, _unscale_free(free, meta), wrench_map(meta.robot))
    phases = max(1, 2 * meta.stance_ms // SAMPLE_MS)
    return PeriodicPredictor(replace(meta, kind="periodic", phases=phases), factors)


def estimate_response(walks: Sequence[Walked], hold: int, meta: PredictorMeta) -> Array:
    """Coefficients of the response to a sample's wrench, scaled. (k, N, n, 6, n, 6).

    Args:
        walks: scaled episodes.
        hold: for how many samples each draw of the force noise is held.
        meta: of the predictor.

    Raises:
        PredictorError: too little data.
    """
    n = meta.robots
    folds = sum_folds(walks, meta.N, hold)
    if len(folds) < _LEAST_FOLDS:
        raise PredictorError(
            "data for the periodic predictor",
            f"{sum(fold.rows for fold in folds)} draws of the force noise",
            "enough to be divided",
            "collect more: identification.seconds",
        )
    total = sum(folds[1:], folds[0])
    estimate = solve_lags(total, n, hold)
    without = np.stack([solve_lags(total - fold, n, hold) for fold in folds])
    tested = shrink(estimate, without)
    response = tested.response
    for i in range(n):
        strangers = [j for j in range(n) if j not in members_of(meta, i)]
        response[:, :, strangers, :, i] = 0.0
    steps = phase_angles(meta, 0, 2)
    return spread_over_samples(response, hold, float(np.diff(steps)[0] % (2.0 * np.pi)))


def _unscale_free(free: Array, meta: PredictorMeta) -> Array:
    """The map of the past in physical outputs; wrenches keep their scale."""
    columns = np.concatenate([np.ones(N_WRENCH * meta.T_ini), np.tile(Y_SCALE, meta.T_ini)])
    physical: Array = free * np.tile(Y_SCALE, meta.N)[:, None] / columns
    return physical
