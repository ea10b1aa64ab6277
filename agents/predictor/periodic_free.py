"""What follows from the past under nominal forces: a periodic map of [w_ini; y_ini] to N outputs.

What the forces of the horizon do is subtracted first, by the responses already known, so this
regression explains the rest. Its penalties are chosen for each output by the error on the last
part of the data, from a fit to the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.predictor.periodic_data import (
    Walked,
    chunks,
    forced,
    modulated,
    outputs_of,
    past_rows,
)
from quadriga.agents.predictor.ridge import factorise
from quadriga.shared.robot.conventions import Array

FREE_ORDER: Final = 1  # harmonics of the map
_HELD_OUT: Final = 0.2  # of the rows, to choose the penalties by
_ROWS: Final = 2048  # rows held in memory at a time
_WORTH: Final = 0.98  # of the error without peers: what that with them must be below
# Candidate penalties per row: on everything, times this on harmonics, times this on peers.
_RIDGES: Final = (1e-3, 1e-2, 1e-1)
_ON_HARMONICS: Final = (1.0, 10.0)
_ON_PEERS: Final = (np.inf, 1.0, 30.0)  # infinite: left out


@dataclass(frozen=True, slots=True)
class _Sums:
    """Σ z zᵀ, (K, K), Σ z yᵀ, (K, N, n, p), Σ y² over all lags, (n, p), and the number of rows."""

    zz: Array
    zy: Array
    yy: Array
    rows: int

    def __add__(self, other: _Sums) -> _Sums:
        return _Sums(
            self.zz + other.zz, self.zy + other.zy, self.yy + other.yy, self.rows + other.rows
        )


def fit_free(walks: Sequence[Walked], h: Array, T_ini: int, peers: NDArray[np.bool_]) -> Array:
    """The map as harmonics. Shape (2 FREE_ORDER + 1, n responding, n, p N, (w + p) T_ini).

    Args:
        walks: scaled episodes.
        h: coefficients of the response to a sample's wrench, (k, N, n, w, n, p).
        T_ini: samples of the past.
        peers: whose past may matter to whom, (n responding, n).

    Raises:
        PredictorError: a singular problem.
    """
    train, rest = _sum_parts(walks, h, T_ini)
    both = train + rest
    waves, (_, N, n, w, _, p) = 2 * FREE_ORDER + 1, h.shape
    width = (w + p) * T_ini
    wave, agent, _ = np.indices((waves, n, width)).reshape(3, -1)
    x = np.zeros((n, p, waves * n * width, N))
    for i in range(n):
        columns = np.flatnonzero(peers[i][agent] | (agent == i))
        candidates = _penalties(agent[columns] == i, wave[columns] > 0)
        for penalty, outputs in _choose_penalties(train, rest, i, candidates, columns):
            solution = _solve(both, i, penalty, columns, outputs)
            for place, output in enumerate(outputs):
                x[i, output, columns] = solution[:, :, place]
    blocks = x.reshape(n, p, waves, n, width, N).transpose(2, 0, 3, 5, 1, 4)
    return blocks.reshape(waves, n, n, N * p, width)


def forced_outputs(walk: Walked, at: NDArray[np.int64], h: Array) -> Array:
    """What the wrenches from samples `at` on do to the outputs there. Shape (len(at), N, p n)."""
    count, N, n, components, _, p = h.shape
    rows = h.transpose(1, 0, 2, 3, 4, 5).reshape(N, count * n * components, n * p)
    y = np.zeros((len(at), N, n * p))
    for s in range(N):
        w = forced(walk, at + s, count // 2 - 1)
        later = rows[: N - s].transpose(1, 0, 2).reshape(w.shape[1], -1)
        y[:, s:] += (w @ later).reshape(len(at), N - s, -1)
    return y


def _sum_parts(walks: Sequence[Walked], h: Array, T_ini: int) -> tuple[_Sums, _Sums]:
    """Sums over the first part of the rows and over the last."""
    _, N, n, w, _, p = h.shape
    K = (2 * FREE_ORDER + 1) * n * (w + p) * T_ini
    total = sum(len(at) for _, at in chunks(walks, T_ini, N, _ROWS, starts=False))
    nothing = np.zeros((K, K)), np.zeros((K, N, n, p)), np.zeros((n, p))
    parts = [_Sums(*nothing, 0)] * 2
    seen = 0
    for walk, at in chunks(walks, T_ini, N, _ROWS, starts=False):
        part = int(seen >= (1.0 - _HELD_OUT) * total)
        past = past_rows(walk, at, T_ini).reshape(len(at), -1)
        z = modulated(past, walk.angle[at], FREE_ORDER)
        y = np.stack([outputs_of(walk, at + lag) for lag in range(N)], axis=1)
        y = (y - forced_outputs(walk, at, h)).reshape(len(at), -1)
        zy = (z.T @ y).reshape(K, N, n, p)
        yy = (y**2).sum(axis=0).reshape(N, n, p).sum(axis=0)
        parts[part] = parts[part] + _Sums(z.T @ z, zy, yy, len(at))
        seen += len(at)
    return parts[0], parts[1]


def _penalties(own: NDArray[np.bool_], harmonic: NDArray[np.bool_]) -> list[Array]:
    """Candidates for the penalties per row on the regressors of one agent's outputs.

    Args:
        own: regressors that are the agent's own.
        harmonic: regressors that change with the gait's phase.
    """
    weights = _ON_PEERS[:1] if own.all() else _ON_PEERS
    return [
        ridge * np.where(harmonic, on_harmonics, 1.0) * np.where(own, 1.0, on_peers)
        for on_peers, ridge, on_harmonics in product(weights, _RIDGES, _ON_HARMONICS)
    ]


def _choose_penalties(
    train: _Sums, rest: _Sums, i: int, candidates: list[Array], columns: NDArray[np.int64]
) -> list[tuple[Array, list[int]]]:
    """Each penalty that is best for some of agent `i`'s outputs, and those outputs.

    Peers count only where they lower the error by more than chance does.
    """
    every = list(range(train.zy.shape[3]))
    if not (train.rows and rest.rows):
        return [(candidates[0], every)]
    zz, zy = rest.zz[np.ix_(columns, columns)], rest.zy[columns, :, i]
    errors = []
    for penalty in candidates:
        x = _solve(train, i, penalty, columns, every)
        squares = (np.tensordot(zz, x, axes=1) - 2.0 * zy) * x
        errors.append(rest.yy[i] + squares.sum(axis=(0, 1)))
    table, alone = np.array(errors), len(_RIDGES) * len(_ON_HARMONICS)
    table[alone:] /= _WORTH**2
    best = np.argmin(table, axis=0)
    return [(candidates[k], np.flatnonzero(best == k).tolist()) for k in np.unique(best)]


def _solve(
    sums: _Sums, i: int, penalty: Array, columns: NDArray[np.int64], outputs: list[int]
) -> Array:
    """Solution for some outputs of agent `i`. Shape (len(columns), N, len(outputs))."""
    counted = np.isfinite(penalty)
    some = columns[counted]
    A = sums.zz[np.ix_(some, some)].copy(order="F")
    A.flat[:: len(A) + 1] += penalty[counted] * sums.rows
    b = sums.zy[some][:, :, i, outputs]
    solution = linalg.cho_solve((factorise(A), True), b.reshape(len(some), -1), check_finite=False)
    x = np.zeros((len(columns), *b.shape[1:]))
    x[counted] = solution.reshape(b.shape)
    return x
