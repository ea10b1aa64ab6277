"""Fits of G by one regression: whether data excite, normal equations, and their solutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.predictor.episode import Layout, scales
from quadriga.agents.predictor.hankel import columns, gram
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

Index = NDArray[np.int64]
# Rounding turns eigenvalues of the Gram matrix that should be zero into up to 1e-16 · (number of
# rows) of the largest. Below 1e-12, which is 1e-6 in singular values of the data, they count as
# zero.
_RANK_TOLERANCE: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Excitation:
    """Result of the rank test: persistently exciting of `order` if `rank` equals `rows`."""

    order: int
    rows: int
    columns: int
    rank: int

    @property
    def persistent(self) -> bool:
        """Whether the Hankel matrix has full row rank (definition 1)."""
        return self.rank == self.rows


def excitation(inputs: Sequence[Array], order: int) -> Excitation:
    """Rank of the Hankel matrix of `order` of the inputs of all episodes together.

    Args:
        inputs: per episode shape (T, m).
        order: L + n, horizon plus system order.
    """
    rows, count = order * inputs[0].shape[1], columns(inputs, order)
    S = gram(inputs, order)
    floor = _RANK_TOLERANCE * max(float(np.linalg.norm(S)), np.finfo(float).tiny)
    S.flat[:: rows + 1] -= floor
    try:  # Cholesky shows 20 times faster that no eigenvalue is small
        linalg.cholesky(S.T, lower=True, overwrite_a=True, check_finite=False)
        rank = rows
    except linalg.LinAlgError:
        eigenvalues = linalg.eigvalsh(gram(inputs, order), overwrite_a=True, check_finite=False)
        rank = int((eigenvalues > floor).sum())
    return Excitation(order, rows, count, rank)


@dataclass(frozen=True, slots=True)
class Regression:
    """Sums over M windows of scaled signals, z = [z^1; …; z^n], z^j = [u_ini^j; y_ini^j; u^j].

    Attributes:
        zz: Σ z zᵀ, shape (n W, n W).
        zy: Σ z y^iᵀ for every agent i, shape (n W, n, p N).
        windows: M.
    """

    zz: Array
    zy: Array
    windows: int


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


def fit_blocks(
    kind: str, signals: Sequence[Array], layout: Layout, penalty: Penalty
) -> tuple[Array, float]:
    """G by one regression over all windows of all episodes.

    Args:
        kind: "pinv" (eq. 6), or "ridge" with the penalty.
        signals: of each episode, scaled: [u of all agents; y of all agents], shape (T, n (m + p)).
        layout: of the predictor.
        penalty: of the ridge.

    Returns:
        Blocks in physical units, shape (1, n, n, p N, W), and the regression's condition number.

    Raises:
        PredictorError: a singular problem.
    """
    regression = normal_equations(signals, layout)
    if kind == "pinv":
        solutions = solve_pinv(regression, layout)
    else:
        solutions = solve_ridge(regression, layout, penalty)
    return to_physical(solutions.x, layout)[None], solutions.condition


def normal_equations(signals: Sequence[Array], layout: Layout) -> Regression:
    """The regression over all windows of all episodes.

    Args:
        signals: of each episode, scaled: [u of all agents; y of all agents], shape (T, n (m + p)).
        layout: of the predictor.
    """
    L = layout.T_ini + layout.N
    return _split_by_agent(gram(signals, L), layout, columns(signals, L))


def solve_pinv(regression: Regression, layout: Layout) -> Solutions:
    """Y_f Z† = (Σ y zᵀ)(Σ z zᵀ)†, the solution of least norm where several are best.

    Solved once for all agents whose regressions have the same columns.
    """
    n = layout.agents
    x, condition = np.zeros((n, n * layout.width, layout.rows)), 0.0
    groups: dict[tuple[int, ...], list[int]] = {}
    for i, members in enumerate(layout.members):
        groups.setdefault(members, []).append(i)
    for members, group in groups.items():
        agents, rows = np.array(group), past_first(layout, members)
        b = regression.zy[np.ix_(rows, agents)].reshape(len(rows), -1)
        solution, one = _solve_least_norm(regression.zz[np.ix_(rows, rows)], b)
        x[np.ix_(agents, rows)] = solution.reshape(len(rows), len(agents), -1).transpose(1, 0, 2)
        condition = max(condition, one)
    return Solutions(x, condition)


def _solve_least_norm(A: Array, b: Array) -> tuple[Array, float]:
    floor = _RANK_TOLERANCE * float(np.linalg.norm(A))
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


def to_physical(x: Array, layout: Layout) -> Array:
    """Blocks in physical units, (n, n, p N, W), from scaled solutions (n, n W, p N)."""
    n = layout.agents
    blocks = x.reshape(n, n, layout.width, -1).transpose(0, 1, 3, 2)
    z_scale, y_scale = scales(layout)
    return np.ascontiguousarray(blocks * y_scale[:, None] / z_scale)


def scaled_blocks(G: Array, layout: Layout) -> Array:
    """Blocks that map scaled signals to scaled signals, of the shape of `G`."""
    z_scale, y_scale = scales(layout)
    return G * z_scale / y_scale[:, None]


def past_first(layout: Layout, members: Sequence[int]) -> Index:
    """Rows of `zz` of some agents by time: all [u_ini; y_ini], then each sample's inputs."""
    rows = np.arange(layout.agents * layout.width).reshape(layout.agents, -1)[list(members)]
    future = rows[:, layout.past :].reshape(len(members), layout.N, layout.inputs)
    return np.concatenate([rows[:, : layout.past].ravel(), future.transpose(1, 0, 2).ravel()])


def agents_first(index: Index, n: int, dim: int) -> Index:
    """Reorder stacked (time, agent, dim) indices to one row of (time, dim) per agent."""
    return index.reshape(-1, n, dim).transpose(1, 0, 2).reshape(n, -1)


def _split_by_agent(S: Array, layout: Layout, windows: int) -> Regression:
    """Cut the Gram matrix of windows of [u of all; y of all] into the agents' parts."""
    n, m, p = layout.agents, layout.inputs, layout.outputs
    index = np.arange((layout.T_ini + layout.N) * n * (m + p)).reshape(-1, n * (m + p))
    past, future = index[: layout.T_ini], index[layout.T_ini :]
    parts = ((past[:, : n * m], m), (past[:, n * m :], p), (future[:, : n * m], m))
    inputs = np.concatenate([agents_first(part, n, dim) for part, dim in parts], axis=1).ravel()
    outputs = agents_first(future[:, n * m :], n, p).ravel()
    return Regression(
        S[np.ix_(inputs, inputs)], S[np.ix_(inputs, outputs)].reshape(len(inputs), n, -1), windows
    )
