"""The fits of G by name, all on scaled deviations of one team's episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.predictor.arx import solve_arx
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.least_squares import solve_gamma, solve_pinv
from quadriga.agents.predictor.periodic import fit_periodic
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.regression import to_physical
from quadriga.agents.predictor.ridge import Penalty, Solutions, solve_causal, solve_ridge
from quadriga.agents.predictor.team_data import (
    regressions_by_phase,
    scaled_signals,
    team_regression,
)

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
    solutions = solve_pinv(team_regression(episodes, meta), meta.layout)
    return _one_phase(solutions, _without_penalty(meta, "pinv"))


def fit_ridge(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """Block-weighted ridge regression of G; with w = 1 the plain one.

    Row i minimises ‖Y_f^i − Σ_j G_ij Z_j‖² + ridge · M · (‖G_ii‖² + w² Σ_{j≠i} ‖G_ij‖²) with M
    columns: effects that the data do not clearly show are not attributed to the peers. Without this
    weight the agents' best responses to each other's last plans diverge.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    solutions = solve_ridge(
        team_regression(episodes, meta), meta.layout, _penalty(meta, meta.ridge)
    )
    return _one_phase(solutions, replace(meta, kind="ridge", phases=1))


def fit_gamma(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """γ-DDPC: G from the LQ factors of [Z_p; U_f; Y_f] (see `solve_gamma`), without a penalty.

    Raises:
        PredictorError: no data, too little, of another team, or forces that do not excite.
    """
    solutions = solve_gamma(team_regression(episodes, meta), meta.layout)
    return _one_phase(solutions, _without_penalty(meta, "gamma"))


def fit_causal(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """Block-weighted ridge with a block-lower-triangular U_f part: no force acts backwards.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    solutions = solve_causal(
        team_regression(episodes, meta), meta.layout, _penalty(meta, meta.ridge)
    )
    return _one_phase(solutions, replace(meta, kind="causal", phases=1))


def fit_arx(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """One-step block-weighted ridge regression, rolled out over N steps by the whole team.

    With yoked neighbours only, the effect of a neighbour's neighbour within the horizon is left
    out: G_ij is zero wherever i and j are not yoked.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    signals = scaled_signals(episodes, meta)
    solutions = solve_arx(signals, meta.layout, _penalty(meta, meta.ridge))
    return _one_phase(solutions, replace(meta, kind="arx", phases=1))


def fit_phase(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """One G for each phase of the gait, drawn towards the ridge fit of all data together.

    Row i of phase p minimises over its own windows the error plus phase_ridge · M_p times the
    block-weighted square of the departure from the pooled fit: a phase without data of its own gets
    the pooled fit.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    layout = meta.layout
    pooled = solve_ridge(team_regression(episodes, meta), layout, _penalty(meta, meta.ridge)).x
    blocks, condition = [], 0.0
    for regression in regressions_by_phase(episodes, meta):
        if regression.windows == 0:
            blocks.append(to_physical(pooled, layout))
            continue
        explained = np.einsum("ab,ibk->aik", regression.zz, pooled, optimize=True)
        left = replace(regression, zy=regression.zy - explained)
        solutions = solve_ridge(left, layout, _penalty(meta, meta.phase_ridge))
        blocks.append(to_physical(pooled + solutions.x, layout))
        condition = max(condition, solutions.condition)
    return Predictor(replace(meta, kind="phase"), np.stack(blocks), condition)


FITS: Final[Mapping[str, Fit]] = {
    "pinv": fit_pinv,
    "ridge": fit_ridge,
    "gamma": fit_gamma,
    "causal": fit_causal,
    "arx": fit_arx,
    "phase": fit_phase,
    "periodic": fit_periodic,
}


def _penalty(meta: PredictorMeta, ridge: float) -> Penalty:
    return Penalty(ridge, meta.block_weight)


def _one_phase(solutions: Solutions, meta: PredictorMeta) -> Predictor:
    return Predictor(meta, to_physical(solutions.x, meta.layout)[None], solutions.condition)


def _without_penalty(meta: PredictorMeta, kind: str) -> PredictorMeta:
    return replace(meta, kind=kind, phases=1, ridge=0.0, block_weight=1.0)
