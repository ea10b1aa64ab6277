"""The part of DeePC (eq. 5) that depends on the data alone and not on any weight.

The data enter through their Gram matrix S alone. With a = [u_ini; u] and b = [y_ini; y] its
Cholesky factor, inputs first, gives every g that matters as two orthogonal parts: one that a
determines, with ‖·‖² = aᵀ S_aa⁻¹ a, and one of free coordinates z:

    b + [σ; 0] = Φ a + M z,   Φ = S_ba S_aa⁻¹,   M Mᵀ = S_bb − S_ba S_aa⁻¹ S_ab

At the optimum g has no part outside the span of the data's rows. g, σ and S belong to scaled
signals, which of a team are deviations (`Episode.scaled_deviations`).
`quadriga.agents.planner.team` makes the QP of this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.predictor.episode import Episode, Layout, team_layout
from quadriga.agents.predictor.hankel import gram
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

Index = NDArray[np.int64]

# Eigenvalues of a Gram matrix below this share of its norm are rounding errors of zero.
_RANK_TOLERANCE: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Reduction:
    """What the data determine independently of the weights; scaled signals, agents first.

    Inputs stack per agent and time-major first all T_ini samples of the past, then all N of the
    future; outputs likewise.

    Attributes:
        layout: sizes of the problem, with L = T_ini + N, and the scales.
        inverse: S_aa⁻¹, shape (m n L, m n L).
        response: Φ, outputs that the inputs explain, shape (p n L, m n L).
        spread: M, outputs that they leave open, shape (p n L, rank).
    """

    layout: Layout
    inverse: Array
    response: Array
    spread: Array


def reduce(episodes: Sequence[Episode], T_ini: int, N: int) -> Reduction:
    """The reduction of a team's data; see `reduce_signals`.

    Args:
        episodes: data of one team; those shorter than T_ini + N are ignored.
        T_ini: estimation horizon.
        N: control horizon.

    Raises:
        PredictorError: no data, of different teams, or forces that do not excite every direction.
    """
    robots = {episode.robots for episode in episodes}
    if len(robots) != 1:
        raise PredictorError("episodes", f"teams of {sorted(robots)} robots", "data of one team")
    signals = [np.concatenate(episode.scaled_deviations(), axis=1) for episode in episodes]
    return reduce_signals(signals, team_layout(robots.pop(), T_ini, N))


def reduce_signals(signals: Sequence[Array], layout: Layout) -> Reduction:
    """Split the outputs in the data into a part that the inputs explain and the rest.

    Args:
        signals: of each episode, scaled: [u of all agents; y of all agents], shape (T, n (m + p));
            those shorter than T_ini + N are ignored.
        layout: of the problem; everybody's columns are used.

    Raises:
        PredictorError: inputs that do not excite every direction.
    """
    L = layout.T_ini + layout.N
    S = gram(signals, L)
    a, b = input_output_rows(layout)
    S_aa, S_ab = S[np.ix_(a, a)], S[np.ix_(a, b)]
    floor = _RANK_TOLERANCE * float(np.linalg.norm(S_aa))
    try:
        linalg.cholesky(S_aa - floor * np.eye(len(a)), check_finite=False)
        factor = linalg.cho_factor(S_aa, check_finite=False)
    except linalg.LinAlgError:
        raise PredictorError(
            "episodes",
            f"inputs of {sum(len(w) for w in signals)} samples that are not "
            f"persistently exciting of order {L}",
            f"a Hankel matrix of rank {len(a)}",
            "too little data, or too little noise in the inputs",
        ) from None
    solved = linalg.cho_solve(factor, np.hstack([S_ab, np.eye(len(a))]), check_finite=False)
    response, inverse = solved[:, : len(b)].T, solved[:, len(b) :]
    S_bb = S[np.ix_(b, b)]
    left = S_bb - response @ S_ab
    values, vectors = linalg.eigh(0.5 * (left + left.T), check_finite=False)
    significant = values > _RANK_TOLERANCE * np.linalg.norm(S_bb)
    spread = vectors[:, significant] * np.sqrt(values[significant])
    return Reduction(layout, 0.5 * (inverse + inverse.T), np.ascontiguousarray(response), spread)


def input_output_rows(layout: Layout) -> tuple[Index, Index]:
    """Rows of the samples' Gram matrix that hold the inputs and the outputs, past before future."""
    n, m, p, T_ini = layout.agents, layout.inputs, layout.outputs, layout.T_ini
    width = n * (m + p)
    index = np.arange((T_ini + layout.N) * width).reshape(-1, width)
    u = index[:, : n * m].reshape(-1, n, m).transpose(1, 0, 2)
    y = index[:, n * m :].reshape(-1, n, p).transpose(1, 0, 2)
    a, b = (np.concatenate([x[:, :T_ini].ravel(), x[:, T_ini:].ravel()]) for x in (u, y))
    return a, b
