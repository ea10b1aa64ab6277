"""Fits of G by one regression over all windows, through the Gram matrix of the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.predictor.episode import Episode, Layout, check_episodes
from quadriga.agents.predictor.hankel import gram
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

Index = NDArray[np.int64]
# Rounding turns eigenvalues of the Gram matrix that should be zero into up to 1e-16 · (number of
# rows) of the largest. Below 1e-12, which is 1e-6 in singular values of the data, they count as
# zero.
_RANK_TOLERANCE: Final = 1e-12


def check_excitation(inputs: Sequence[Array], order: int) -> None:
    """Refuse inputs, per episode (T, m), from which the plant's response cannot be told.

    For the fundamental lemma `order` is the horizon plus the plant's order.

    Raises:
        PredictorError: together they are not persistently exciting of this order: the rank of their
            Hankel matrix is below m · order (definition 1).
    """
    S = gram(inputs, order)
    S.flat[:: len(S) + 1] -= _RANK_TOLERANCE * float(np.linalg.norm(S))
    try:
        factorise(S.T)
    except PredictorError:
        raise PredictorError(
            "inputs in the data",
            f"a Hankel matrix of a rank below {len(S)}",
            f"rank {len(S)}: persistently exciting of order {order}",
            "too little data, or an input that hardly varies: more noise, or shorter holds of it",
        ) from None


class Regression(NamedTuple):
    """Sums over M windows of scaled signals, z = [z^1; …; z^n], z^j = [u_ini^j; y_ini^j; u^j].

    Attributes:
        zz: Σ z zᵀ, shape (n W, n W).
        zy: Σ z y^iᵀ for every agent i, shape (n W, n, p N).
        windows: M.
    """

    zz: Array
    zy: Array
    windows: int


def normal_equations(episodes: Sequence[Episode], layout: Layout) -> Regression:
    """The regression over all windows of all episodes.

    Raises:
        PredictorError: no data, too little, or of another plant.
    """
    S, windows, (u, y) = _sample_gram(episodes, layout)
    n, T_ini = layout.agents, layout.T_ini
    parts = u[:, :T_ini], y[:, :T_ini], u[:, T_ini:]
    inputs = np.concatenate([part.reshape(n, -1) for part in parts], axis=1).ravel()
    outputs = y[:, T_ini:].ravel()
    zz, zy = S[np.ix_(inputs, inputs)], S[np.ix_(inputs, outputs)]
    return Regression(zz, zy.reshape(len(inputs), n, -1), windows)


def solve_pinv(regression: Regression, layout: Layout) -> Array:
    """Y_f Z† = (Σ y zᵀ)(Σ z zᵀ)†, the solution of least norm where several are best (eq. 6).

    Returns:
        Scaled solutions, shape (n, n W, p N); zero in the rows of agents left out.
    """
    x = np.zeros((layout.agents, layout.agents * layout.width, layout.rows))
    for members in set(layout.members):  # solved once for all agents with the same columns
        agents = np.array([i for i, of in enumerate(layout.members) if of == members])
        rows = _columns_of(members, layout)
        b = regression.zy[np.ix_(rows, agents)].reshape(len(rows), -1)
        solution = _solve_least_norm(regression.zz[np.ix_(rows, rows)], b)
        x[np.ix_(agents, rows)] = solution.reshape(len(rows), len(agents), -1).transpose(1, 0, 2)
    return x


def solve_ridge(regression: Regression, layout: Layout, ridge: float, weight: float) -> Array:
    """Penalty ridge · M on agent i's own columns and weight² times as much on its peers'.

    Returns:
        Scaled solutions, shape (n, n W, p N); zero in the rows of agents left out.

    Raises:
        PredictorError: a singular problem.
    """
    x = np.zeros((layout.agents, layout.agents * layout.width, layout.rows))
    for i, members in enumerate(layout.members):
        rows = _columns_of(members, layout)
        A = regression.zz[np.ix_(rows, rows)]
        penalty = np.where(rows // layout.width == i, 1.0, weight**2)
        A.flat[:: len(A) + 1] += ridge * regression.windows * penalty
        factor = factorise(A.T)  # symmetric, and in LAPACK's order
        x[i, rows] = linalg.cho_solve((factor, True), regression.zy[rows, i], check_finite=False)
    return x


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


def to_physical(x: Array, layout: Layout) -> Array:
    """Blocks in physical units, (n, n, p N, W), from scaled solutions (n, n W, p N)."""
    n = layout.agents
    blocks = x.reshape(n, n, layout.width, -1).transpose(0, 1, 3, 2)
    z_scale, y_scale = layout.scales()
    return np.ascontiguousarray(blocks * y_scale[:, None] / z_scale)


def _sample_gram(
    episodes: Sequence[Episode], layout: Layout
) -> tuple[Array, int, tuple[Index, Index]]:
    """Gram matrix of windows of scaled [u of all agents; y of all], and how many windows.

    Also the places of u, (n, L, m), and of y, (n, L, p), in it.
    """
    check_episodes(episodes, layout)
    signals = [np.concatenate(each.scaled_deviations(layout), axis=1) for each in episodes]
    L, n, inputs = layout.T_ini + layout.N, layout.agents, layout.agents * layout.inputs
    index = np.arange(L * signals[0].shape[1]).reshape(L, -1)
    u, y = (part.reshape(L, n, -1).swapaxes(0, 1) for part in np.split(index, [inputs], axis=1))
    return gram(signals, L), sum(each.samples - L + 1 for each in episodes), (u, y)


def _columns_of(members: Sequence[int], layout: Layout) -> Index:
    rows: Index = (np.array(members)[:, None] * layout.width + np.arange(layout.width)).ravel()
    return rows


def _solve_least_norm(A: Array, b: Array) -> Array:
    floor = _RANK_TOLERANCE * float(np.linalg.norm(A))
    try:  # Cholesky shows much faster that no eigenvalue is small
        factorise((A - floor * np.eye(len(A))).T)
    except PredictorError:
        values, vectors = linalg.eigh(A, check_finite=False)
        significant = values > floor
        V = vectors[:, significant]
        return V @ ((V.T @ b) / values[significant, None])
    x: Array = linalg.cho_solve((factorise(A.T), True), b, check_finite=False)
    return x


# ---- DeePC (eq. 5): what depends on the data alone and not on any weight


@dataclass(frozen=True, slots=True)
class Reduction:
    """b + [σ; 0] = Φ a + M z with a = [u_ini; u] and b = [y_ini; y], scaled, agents first.

    The Cholesky factor of the data's Gram matrix S, inputs first, gives every g that matters as two
    orthogonal parts: one that a determines, with ‖·‖² = aᵀ S_aa⁻¹ a, and one of free coordinates z.
    At the optimum g has no part outside the span of the data's rows.
    `quadriga.agents.planner.team` makes the QP of this.

    Attributes:
        layout: sizes of the problem, with L = T_ini + N, and the scales.
        inverse: S_aa⁻¹, shape (m n L, m n L).
        response: Φ = S_ba S_aa⁻¹, outputs that the inputs explain, shape (p n L, m n L).
        spread: M, M Mᵀ = S_bb − S_ba S_aa⁻¹ S_ab, what they leave open, shape (p n L, rank).
    """

    layout: Layout
    inverse: Array
    response: Array
    spread: Array


def reduce(episodes: Sequence[Episode], layout: Layout) -> Reduction:
    """Split the outputs in the data into a part that the inputs explain and the rest.

    Raises:
        PredictorError: no data, too little, of another plant, or inputs that do not excite.
    """
    (S, _, places), T_ini = _sample_gram(episodes, layout), layout.T_ini
    a, b = (np.concatenate([x[:, :T_ini].ravel(), x[:, T_ini:].ravel()]) for x in places)
    S_aa, S_ab = S[np.ix_(a, a)], S[np.ix_(a, b)]
    check_excitation([each.scaled_deviations(layout)[0] for each in episodes], T_ini + layout.N)
    factor = linalg.cho_factor(S_aa, check_finite=False)
    solved = linalg.cho_solve(factor, np.hstack([S_ab, np.eye(len(a))]), check_finite=False)
    response, inverse = solved[:, : len(b)].T, solved[:, len(b) :]
    S_bb = S[np.ix_(b, b)]
    left = S_bb - response @ S_ab
    values, vectors = linalg.eigh(0.5 * (left + left.T), check_finite=False)
    significant = values > _RANK_TOLERANCE * np.linalg.norm(S_bb)
    spread = vectors[:, significant] * np.sqrt(values[significant])
    return Reduction(layout, 0.5 * (inverse + inverse.T), np.ascontiguousarray(response), spread)
