"""Predictors of a plant from its data, by several fits."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.least_squares import solve_pinv
from quadriga.agents.predictor.regression import normal_equations, to_physical
from quadriga.agents.predictor.ridge import Penalty, solve_ridge
from quadriga.data_driven.excitation import check_excitation
from quadriga.data_driven.fitted_predictor import FittedPredictor
from quadriga.data_driven.periodic import fit_periodic_blocks
from quadriga.data_driven.trajectories import Data
from quadriga.shared.errors import PredictorError, did_you_mean

KINDS: Final = ("spc", "ridge", "periodic")


def fit(
    data: Data,
    kind: str = "spc",
    past: int = 4,
    horizon: int = 30,
    *,
    ridge: float = 1e-6,
    peer_weight: float = 1.0,
    period: int | None = None,
    input_map: ArrayLike | None = None,
) -> FittedPredictor:
    """Fit the matrix G that maps past and future inputs to future outputs (eq. 6).

    - `spc`: subspace predictive control, the pseudo-inverse of eq. 6, of least norm;
    - `ridge`: least squares with a penalty, for less variance where data are noisy or few;
    - `periodic`: a G of its own for each sample of a period, in which no input acts backwards.

    Signals are scaled by their root mean square before they are fitted, so that a ridge means the
    same for every plant.

    Args:
        data: of the plant; episodes shorter than past + horizon are ignored.
        kind: one of `KINDS`.
        past: T_ini, samples that tell the plant's state: at least its lag.
        horizon: N, samples to predict.
        ridge: penalty per window on scaled columns, of `ridge`.
        peer_weight: of a plant of several agents: the penalty on what one does to another is this
            squared times as large.
        period: of `periodic`: samples after which the plant repeats itself; see `Data.first`.
        input_map: of `periodic`: what the inputs of an agent act by, shape (w, m), such as the net
            wrench of forces; the identity if left out.

    Raises:
        PredictorError: an unknown kind, too little data, or inputs that do not excite the plant.
    """
    _check(kind, ridge, peer_weight, period)
    layout = data.layout(past, horizon)
    if period is not None:
        actions = np.eye(data.inputs) if input_map is None else input_map
        blocks = fit_periodic_blocks(data, layout, period, actions)
        return FittedPredictor(kind, layout, blocks, data.single)
    if kind == "spc" or ridge == 0.0:
        check_excitation(data, past + horizon)
    regression = normal_equations(data.scaled(layout), layout)
    if kind == "spc":
        solutions = solve_pinv(regression, layout)
    else:
        solutions = solve_ridge(regression, layout, Penalty(ridge, peer_weight))
    blocks = to_physical(solutions.x, layout)[None]
    return FittedPredictor(kind, layout, blocks, data.single, solutions.condition)


def _check(kind: str, ridge: float, peer_weight: float, period: int | None) -> None:
    """Refuse what no fit can do, or what would be asked for in vain.

    Raises:
        PredictorError: an unknown kind, a period for another one, or penalties out of range.
    """
    if kind not in KINDS:
        raise PredictorError("kind", repr(kind), ", ".join(KINDS), did_you_mean(kind, KINDS))
    if (period is not None) != (kind == "periodic"):
        raise PredictorError(
            "period", f"{period} with kind {kind!r}", 'a period with "periodic", else none'
        )
    if not (ridge >= 0.0 and peer_weight > 0.0):
        raise PredictorError(
            "ridge, peer_weight", f"{ridge:g}, {peer_weight:g}", "not negative, and positive"
        )
