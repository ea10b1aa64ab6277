"""How well a predictor predicts data that it was not fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quadriga.agents.predictor.hankel import windows
from quadriga.data_driven.fitted_predictor import FittedPredictor
from quadriga.data_driven.trajectories import Data
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """Errors over all windows, samples of the horizon and agents, in the units of the outputs.

    Attributes:
        windows: how many were predicted.
        rmse: root mean square of the error of each output, shape (p,).
        persistence: the same if every output kept its last measured value, shape (p,).
        ratio: of the two, outputs in their scales; below 1 the predictor is of use.
    """

    windows: int
    rmse: Array
    persistence: Array
    ratio: float


def judge(predictor: FittedPredictor, data: Data) -> Judgement:
    """Predict every window of data and compare.

    Args:
        predictor: of the plant.
        data: not those it was fitted to; episodes shorter than past + horizon are ignored.

    Raises:
        PredictorError: data of another plant, or too short.
    """
    layout = predictor.layout
    got = data.agents, data.inputs, data.outputs
    expected = layout.agents, layout.inputs, layout.outputs
    if got != expected:
        raise PredictorError("data", f"(agents, inputs, outputs) = {got}", f"{expected}")
    length = layout.T_ini + layout.N
    count, errors, naive = 0, np.zeros(layout.outputs), np.zeros(layout.outputs)
    for u, y, first in zip(data.u, data.y, data.first, strict=True):
        if len(u) < length:
            continue
        z, future = windows(u, y, layout.T_ini, layout.N)
        shape = (layout.agents, layout.N, layout.outputs, -1)
        error = _predict(predictor, z, first) - future
        last = z[:, layout.inputs * layout.T_ini : layout.past].reshape(
            layout.agents, layout.T_ini, layout.outputs, -1
        )[:, -1:]
        errors += (error.reshape(shape) ** 2).sum(axis=(0, 1, 3))
        naive += ((future.reshape(shape) - last) ** 2).sum(axis=(0, 1, 3))
        count += z.shape[2]
    if not count:
        raise PredictorError(
            "data", "no episode that long", f"at least {length} samples", "too little data"
        )
    total = count * layout.N * layout.agents
    rmse, persistence = np.sqrt(errors / total), np.sqrt(naive / total)
    scale = np.array(layout.y_scale)
    naive_size = float(np.linalg.norm(persistence / scale))
    ratio = float(np.linalg.norm(rmse / scale)) / naive_size if naive_size > 0.0 else np.inf
    return Judgement(count, rmse, persistence, ratio)


def _predict(predictor: FittedPredictor, z: Array, first: int) -> Array:
    """Predicted outputs of windows of an episode, (n, p N, C)."""
    n, _, count = z.shape
    stacked = z.reshape(-1, count)
    y = np.empty((n * predictor.layout.rows, count))
    phases = (first + predictor.past + np.arange(count)) % predictor.period
    for phase in np.unique(phases):
        now = phases == phase
        y[:, now] = predictor.matrix(int(phase)) @ stacked[:, now]
    return y.reshape(n, -1, count)
