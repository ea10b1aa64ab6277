"""The fits of G by name, all on scaled deviations of one team's episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.least_squares import solve_pinv
from quadriga.agents.predictor.periodic import fit_periodic
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.regression import to_physical
from quadriga.agents.predictor.ridge import Penalty, Solutions, solve_ridge
from quadriga.agents.predictor.team_data import team_regression

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
    plain = replace(meta, kind="pinv", phases=1, ridge=0.0, block_weight=1.0)
    return _one_phase(solutions, plain)


def fit_ridge(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """Block-weighted ridge regression of G; with w = 1 the plain one.

    Row i minimises ‖Y_f^i − Σ_j G_ij Z_j‖² + ridge · M · (‖G_ii‖² + w² Σ_{j≠i} ‖G_ij‖²) with M
    columns: effects that the data do not clearly show are not attributed to the peers. Without this
    weight the agents' best responses to each other's last plans diverge.

    Raises:
        PredictorError: no data, too little, of another team, or a singular problem.
    """
    penalty = Penalty(meta.ridge, meta.block_weight)
    solutions = solve_ridge(team_regression(episodes, meta), meta.layout, penalty)
    return _one_phase(solutions, replace(meta, kind="ridge", phases=1))


FITS: Final[Mapping[str, Fit]] = {"pinv": fit_pinv, "ridge": fit_ridge, "periodic": fit_periodic}


def _one_phase(solutions: Solutions, meta: PredictorMeta) -> Predictor:
    return Predictor(meta, to_physical(solutions.x, meta.layout)[None], solutions.condition)
