"""The periodic fit: G as a function of the gait's phase, causal, with peers by their net wrench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.layout import Layout
from quadriga.agents.predictor.measured_response import fit_measured_response, read_pulse_responses
from quadriga.agents.predictor.periodic_basis import phase_angles, wrench_map
from quadriga.agents.predictor.periodic_data import Walked, scale_episodes
from quadriga.agents.predictor.periodic_free import fit_free
from quadriga.agents.predictor.periodic_predictor import PeriodicFactors, PeriodicPredictor
from quadriga.agents.predictor.periodic_response import solve_lags, spread_over_samples, sum_folds
from quadriga.agents.predictor.periodic_shrinkage import shrink
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.team_data import check_episodes
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
        step = float(np.diff(phase_angles(meta, 0, 2))[0] % (2.0 * np.pi))
        h = estimate_response(walks, hold, meta.layout, step)
    factors = fit_factors(walks, h, meta.layout, wrench_map(meta.robot))
    phases = max(1, 2 * meta.stance_ms // SAMPLE_MS)
    return PeriodicPredictor(replace(meta, kind="periodic", phases=phases), factors)


def estimate_response(
    walks: Sequence[Walked], hold: int, layout: Layout, angle_step: float
) -> Array:
    """Coefficients of the response to a sample's wrench, scaled. (k, N, n, w, n, p).

    Args:
        walks: scaled episodes.
        hold: for how many samples each draw of the inputs' noise is held.
        layout: of the predictor.
        angle_step: what the phase advances in a sample, rad.

    Raises:
        PredictorError: too little data.
    """
    n = layout.agents
    folds = sum_folds(walks, layout.N, hold)
    if len(folds) < _LEAST_FOLDS:
        raise PredictorError(
            "data for the periodic predictor",
            f"{sum(fold.rows for fold in folds)} draws of the inputs' noise",
            "enough to be divided",
            "collect more: identification.seconds",
        )
    total = sum(folds[1:], folds[0])
    estimate = solve_lags(total, n, hold)
    without = np.stack([solve_lags(total - fold, n, hold) for fold in folds])
    tested = shrink(estimate, without)
    response = tested.response
    for i in range(n):
        response[:, :, layout.strangers(i), :, i] = 0.0
    return spread_over_samples(response, hold, angle_step)


def fit_factors(
    walks: Sequence[Walked], h: Array, layout: Layout, wrench: Array
) -> PeriodicFactors:
    """What G is made of: the responses, and by them what follows from the past.

    Args:
        walks: scaled episodes.
        h: coefficients of the response to a sample's wrench, scaled, (k, N, n, w, n, p).
        layout: of the predictor.
        wrench: from an agent's inputs to what they act by, (w, m).

    Raises:
        PredictorError: a singular problem.
    """
    n, y_scale = layout.agents, np.array(layout.y_scale)
    peers = np.array([[j in layout.members[i] for j in range(n)] for i in range(n)])
    free = fit_free(walks, h, layout.T_ini, peers)
    # Wrenches keep their scale.
    columns = np.concatenate([np.ones(len(wrench) * layout.T_ini), np.tile(y_scale, layout.T_ini)])
    physical = free * np.tile(y_scale, layout.N)[:, None] / columns
    return PeriodicFactors(h * y_scale, physical, wrench)
