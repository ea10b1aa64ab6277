"""The periodic fit of any plant: one G for each sample of the period."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.layout import Layout
from quadriga.agents.predictor.periodic import estimate_response, fit_factors
from quadriga.agents.predictor.periodic_data import Walked, draw_starts, held_samples
from quadriga.data_driven.signals import as_numbers, root_mean_squares
from quadriga.data_driven.trajectories import Data
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


def fit_periodic_blocks(data: Data, layout: Layout, period: int, input_map: ArrayLike) -> Array:
    """Blocks of G for every sample of the period, (period, n, n, p N, W).

    The inputs must be random and independent of the outputs; each draw may be held for some
    samples, the same number everywhere. Responses are polynomials of the phase in each half of the
    period.

    Args:
        data: of the plant.
        layout: of the predictor.
        period: in samples.
        input_map: what an agent's inputs act by, (w, m).

    Raises:
        PredictorError: no such period or map, or too little data.
    """
    actions = as_numbers("input_map", input_map)
    if actions.ndim != 2 or actions.shape[1] != layout.inputs:
        raise PredictorError("input_map", f"shape {actions.shape}", f"(w, {layout.inputs})")
    if period < 2:
        raise PredictorError("period", f"{period} samples", "at least 2")
    sizes = np.array(root_mean_squares(tuple(u @ actions.T for u in data.u)))
    actions = actions / sizes[:, None]
    inputs = [u / np.array(layout.u_scale) for u in data.u]
    hold, step = held_samples(inputs), 2.0 * np.pi / period
    episodes = tuple(
        Walked(
            u @ actions.T,
            y / np.array(layout.y_scale),
            np.zeros((*u.shape[:2], 0)),
            2.0 * np.pi / period * ((first + np.arange(len(u), dtype=np.float64)) % period),
            draw_starts(scaled, hold),
        )
        for u, y, first, scaled in zip(data.u, data.y, data.first, inputs, strict=True)
    )
    h = estimate_response(episodes, hold, layout, step)
    factors = fit_factors(episodes, h, layout, actions)
    agents = range(layout.agents)
    return np.array(
        [[[factors.block(i, j, k, period) for j in agents] for i in agents] for k in range(period)]
    )
