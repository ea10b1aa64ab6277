"""Solutions of the penalised normal equations (Σ z zᵀ + D_i) x_i = Σ z y^iᵀ of every agent i."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from quadriga.agents.predictor.layout import Layout
from quadriga.agents.predictor.regression import Regression
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


@dataclass(frozen=True, slots=True)
class Solutions:
    """A solver's result.

    Attributes:
        x: scaled solutions, shape (n, n W, p N); zero in the rows of agents left out.
        condition: of the regularised normal equations, in the 1-norm, of one agent or the worst.
    """

    x: Array
    condition: float


@dataclass(frozen=True, slots=True)
class Penalty:
    """The block-weighted penalty of a ridge regression.

    Attributes:
        ridge: per window, on scaled columns.
        weight: w of the peers' blocks; 1: all columns alike.
    """

    ridge: float
    weight: float = 1.0

    def of(self, regression: Regression) -> tuple[float, float]:
        """Penalty on an agent's own columns and on those of its peers."""
        own = self.ridge * regression.windows
        return own, own * self.weight**2


def solve_ridge(regression: Regression, layout: Layout, penalty: Penalty) -> Solutions:
    """Penalty ridge · M on agent i's own columns and w² times as much on its peers'.

    Raises:
        PredictorError: a singular problem.
    """
    n, W = layout.agents, layout.width
    light, heavy = penalty.of(regression)
    if all(len(members) == n for members in layout.members):
        A = _add_penalty(regression.zz, np.where(np.arange(n * W) < W, light, heavy))
        condition = condition_number(_norm(A), factorise(A))
        return Solutions(_solve_each(regression.zz, regression.zy, W, light, heavy), condition)
    x, condition = np.zeros((n, n * W, layout.rows)), 0.0
    for i, members in enumerate(layout.members):
        rows = (np.array(members)[:, None] * W + np.arange(W)).ravel()
        A = _add_penalty(regression.zz[np.ix_(rows, rows)], np.where(rows // W == i, light, heavy))
        norm, factor = _norm(A), factorise(A)
        x[i, rows] = linalg.cho_solve((factor, True), regression.zy[rows, i], check_finite=False)
        condition = max(condition, condition_number(norm, factor))
    return Solutions(x, condition)


def factorise(A: Array) -> Array:
    """Lower Cholesky factor of `A`, which is overwritten; its upper triangle is not set.

    Raises:
        PredictorError: `A` is not positive definite.
    """
    try:
        return linalg.cho_factor(A, lower=True, overwrite_a=True, check_finite=False)[0]
    except linalg.LinAlgError:
        raise PredictorError(
            "the predictor's regression",
            "a singular problem",
            "data that excite every direction, or a larger ridge (identification.ridge)",
            "too little noise or data",
        ) from None


def condition_number(norm: float, factor: Array) -> float:
    """Estimate of ‖A‖₁ ‖A⁻¹‖₁ from ‖A‖₁ and the lower Cholesky factor of A."""
    reciprocal, _ = linalg.lapack.dpocon(factor, norm, uplo="L")
    return 1.0 / reciprocal if reciprocal > 0.0 else np.inf


def _norm(A: Array) -> float:
    return float(np.linalg.norm(A, 1))


def _add_penalty(A: Array, penalty: Array | float) -> Array:
    """A copy of `A` in LAPACK's order with a penalty on its diagonal."""
    copy: Array = A.T.copy(order="F")  # symmetric: the transpose is the same and copies faster
    copy.flat[:: len(A) + 1] += penalty
    return copy


def _solve_each(A: Array, b: Array, W: int, light: float, heavy: float) -> Array:
    """Solutions x_i of (A + D_i) x_i = b_i, D_i = light on block i and heavy on all others.

    One half of the blocks, all with the heavy penalty, is eliminated, which leaves the same problem
    for the other half; so all n solutions cost 7/3 of one factorisation. Correcting one common
    factorisation for each block would lose digits where the ratio of the penalties is large.

    Args:
        A: shape (n W, n W).
        b: right-hand sides, shape (n W, n, k).
        W: size of a block.
        light: penalty on the own block.
        heavy: penalty on the others.

    Returns:
        Shape (n, n W, k).
    """
    n, k = len(A) // W, b.shape[2]
    if n == 1:
        factor = factorise(_add_penalty(A, light))
        return linalg.cho_solve((factor, True), b[:, 0], check_finite=False)[None]
    x = np.empty((n, n * W, k))
    for half, eliminated in (
        (slice(0, n // 2), slice(n // 2, n)),
        (slice(n // 2, n), slice(0, n // 2)),
    ):
        K, D = (slice(s.start * W, s.stop * W) for s in (half, eliminated))
        factor = factorise(_add_penalty(A[D, D], heavy))
        X, R = (
            linalg.solve_triangular(factor, rhs, lower=True, check_finite=False)
            for rhs in (A[D, K], b[D, half].reshape(D.stop - D.start, -1))
        )
        rest = b[K, half] - (X.T @ R).reshape(K.stop - K.start, -1, k)
        solution = _solve_each(A[K, K] - X.T @ X, rest, W, light, heavy)
        x[half, K] = solution
        across = R - (X @ solution.transpose(1, 0, 2).reshape(K.stop - K.start, -1))
        back = linalg.solve_triangular(factor, across, lower=True, trans=1, check_finite=False)
        x[half, D] = back.reshape(D.stop - D.start, -1, k).transpose(1, 0, 2)
    return x
