"""Predictions of all windows of an episode, each by the G of its phase."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.time_grid import gait_phase
from quadriga.shared.robot.conventions import N_OUTPUTS, Array
from quadriga.shared.wire.topics import SAMPLE_MS


def window_phases(predictor: Predictor, episode: Episode, windows: int) -> NDArray[np.int64]:
    """The predictor's phase at the end of each window's past. Shape (windows,)."""
    meta = predictor.meta
    ends = episode.first_tick + SAMPLE_MS * (meta.T_ini - 1 + np.arange(windows))
    phases = [gait_phase(int(t), meta.stand_ms, meta.stance_ms, predictor.phases) for t in ends]
    return np.array(phases, dtype=np.int64)


def predict_windows(predictor: Predictor, phases: NDArray[np.int64], z: Array) -> Array:
    """Predicted output deviations of windows of `Episode.windows`.

    Args:
        predictor: of the team.
        phases: of each window, shape (C,).
        z: per robot [u_ini; y_ini; u], shape (n, 18 T_ini + 12 N, C).

    Returns:
        Shape (n, 6 N, C).
    """
    meta = predictor.meta
    y = np.empty((meta.robots, N_OUTPUTS * meta.N, z.shape[2]))
    for phase in np.unique(phases):
        now = phases == phase
        y[:, :, now] = predictor.predict(z[:, :, now], int(phase))
    return y
