"""Solution of the normal equations without a penalty: the pseudo-inverse (eq. 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy import linalg

from quadriga.agents.predictor.layout import Layout
from quadriga.agents.predictor.regression import Index, Regression, past_first
from quadriga.agents.predictor.ridge import Solutions, condition_number, factorise
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array

# Rounding turns eigenvalues of the Gram matrix that should be zero into up to 1e-16 · (number of
# rows) of the largest. Below 1e-12, which is 1e-6 in singular values of the data, they count as
# zero.
RANK_TOLERANCE = 1e-12

Solve = Callable[[Array, Array], tuple[Array, float]]


def solve_pinv(regression: Regression, layout: Layout) -> Solutions:
    """Y_f Z† = (Σ y zᵀ)(Σ z zᵀ)†, the solution of least norm where several are best."""
    return _solve_groups(regression, layout, _solve_least_norm)


def _solve_least_norm(A: Array, b: Array) -> tuple[Array, float]:
    floor = RANK_TOLERANCE * float(np.linalg.norm(A))
    norm = float(np.linalg.norm(A, 1))
    try:  # Cholesky shows much faster that no eigenvalue is small
        shifted = A.copy(order="F")
        shifted.flat[:: len(A) + 1] -= floor
        factorise(shifted)
        factor = factorise(A.copy(order="F"))
        x: Array = linalg.cho_solve((factor, True), b, check_finite=False)
        return x, condition_number(norm, factor)
    except PredictorError:
        values, vectors = linalg.eigh(A, check_finite=False)
        significant = values > floor
        V = vectors[:, significant]
        return V @ ((V.T @ b) / values[significant, None]), float(
            values[-1] / values[significant][0]
        )


def _solve_groups(regression: Regression, layout: Layout, solve: Solve) -> Solutions:
    """Solve once for all agents whose regressions have the same columns."""
    n = layout.agents
    x, condition = np.zeros((n, n * layout.width, layout.rows)), 0.0
    for agents, rows in _groups(layout):
        b = regression.zy[np.ix_(rows, agents)].reshape(len(rows), -1)
        solution, one = solve(regression.zz[np.ix_(rows, rows)], b)
        x[np.ix_(agents, rows)] = solution.reshape(len(rows), len(agents), -1).transpose(1, 0, 2)
        condition = max(condition, one)
    return Solutions(x, condition)


def _groups(layout: Layout) -> Iterator[tuple[Index, Index]]:
    groups: dict[tuple[int, ...], list[int]] = {}
    for i, members in enumerate(layout.members):
        groups.setdefault(members, []).append(i)
    for members, agents in groups.items():
        yield np.array(agents), past_first(layout, members)
