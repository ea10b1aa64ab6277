"""Periodic responses to net wrenches: local projections, one regression for each lag.

For every sample t with which a new draw w_t of the force noise begins, and every lag l,

    y_{t+l} − Σ_s g_{l−s}(θ_{t+s}) w_{t+s} = g_l(θ_t) w_t + c_l z_t + e,   s = S, 2S, … ≤ l,

with the later draws' responses subtracted as they are known from smaller lags. z_t holds what came
before t. The noise is drawn independently of all that, so g is unbiased whatever z_t leaves out;
what z_t explains only lowers the variance. All lags have the same regressors: one factorisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.predictor.periodic_basis import harmonics, shift_polynomials
from quadriga.agents.predictor.periodic_data import Walked, chunks, forced, outputs_of, past_rows
from quadriga.agents.predictor.ridge import factorise
from quadriga.shared.robot.conventions import Array

DEGREE: Final = 3  # of the polynomials of the phase in a response
FOLDS: Final = 10
_PAST: Final = 6  # samples before a pulse that explain what would have happened without it
_MEAN_ORDER: Final = 5  # harmonics of the mean walk
_COMMANDS: Final = 5  # places of the horizon at which the commanded outputs are looked at
_RIDGE: Final = 1e-3  # per row, of all regressors
_ROWS: Final = 4096  # rows held in memory at a time
_SMOOTH: Final = 0.01  # weight of a bend over the lags against the response itself


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over the rows of one fold; K regressors, the last kw of them the pulse's.

    Attributes:
        zz: Σ z zᵀ, (K, K).
        zw: Σ z (later draw)ᵀ, for each later draw, (draws, K, kw).
        zy: Σ z yᵀ for each lag, (N, K, p n).
        rows: how many.
    """

    zz: Array
    zw: Array
    zy: Array
    rows: int

    def __add__(self, other: Sums) -> Sums:
        return Sums(
            self.zz + other.zz, self.zw + other.zw, self.zy + other.zy, self.rows + other.rows
        )

    def __sub__(self, other: Sums) -> Sums:
        return Sums(
            self.zz - other.zz, self.zw - other.zw, self.zy - other.zy, self.rows - other.rows
        )


def sum_folds(walks: Sequence[Walked], N: int, hold: int) -> list[Sums]:
    """Sums of the regression over `FOLDS` parts of the walks, one after the other in time.

    Args:
        walks: scaled episodes.
        N: lags.
        hold: for how many samples each draw of the noise is held, S.
    """
    total = sum(len(at) for _, at in chunks(walks, _PAST, N, _ROWS, starts=True))
    size = max(1, min(_ROWS, -(-total // FOLDS)))
    folds: list[Sums | None] = [None] * FOLDS
    seen = 0
    for walk, at in chunks(walks, _PAST, N, size, starts=True):
        fold = min(FOLDS - 1, seen * FOLDS // max(total, 1))
        part = _sum_rows(walk, at, N, hold)
        before = folds[fold]
        folds[fold] = part if before is None else before + part
        seen += len(at)
    return [fold for fold in folds if fold is not None]


def solve_lags(sums: Sums, n: int, hold: int) -> Array:
    """Coefficients of the responses g to a held draw. Shape (2 DEGREE + 2, N, n, w, n, p).

    Axes: polynomial, lag, agent that pushes, wrench, agent that responds, output.

    Raises:
        PredictorError: a singular problem.
    """
    N, K, outputs = sums.zy.shape
    kw = sums.zw.shape[2]
    penalised = sums.zz.copy(order="F")
    penalised.flat[:: K + 1] += _RIDGE * sums.rows
    factor = factorise(penalised)
    g = np.zeros((N, kw, outputs))
    for lag in range(N):
        rest = sums.zy[lag].copy()
        for draw in range(lag // hold):
            rest -= sums.zw[draw] @ g[lag - hold * (draw + 1)]
        g[lag] = linalg.cho_solve((factor, True), rest, check_finite=False)[K - kw :]
    return g.reshape(N, 2 * DEGREE + 2, n, -1, n, outputs // n).swapaxes(0, 1)


def spread_over_samples(g: Array, hold: int, angle_step: float) -> Array:
    """Responses h to single samples that add up to the responses g to S samples in a row.

    g_l(θ) = Σ_m h_{l−m}(θ + m δ), m = 0 … S − 1: linear in the polynomials' coefficients. What it
    leaves open is chosen smooth in the lag.

    Args:
        g: coefficients of the response to a held draw, (2 DEGREE + 2, N, …).
        hold: S.
        angle_step: δ, what the phase advances in a sample, rad.
    """
    if hold == 1:
        return g
    count, N = g.shape[:2]
    shift = shift_polynomials(count // 2 - 1, angle_step)
    add = np.eye(count * N)
    for m in range(1, hold):
        add += np.kron(np.linalg.matrix_power(shift, m), np.eye(N, k=-m))
    bend = np.kron(np.eye(count), np.diff(np.eye(N), n=2, axis=0)[1:])  # the first lag may jump
    normal = add.T @ add + _SMOOTH * bend.T @ bend
    h = linalg.solve(normal, add.T @ g.reshape(count * N, -1), assume_a="pos")
    spread: Array = h.reshape(g.shape)
    return spread


def _sum_rows(walk: Walked, at: NDArray[np.int64], N: int, hold: int) -> Sums:
    pulse = forced(walk, at, DEGREE)
    ahead = at[:, None] + np.linspace(0, N, _COMMANDS + 1).astype(int)[1:] - 1
    commands = walk.base[ahead] - walk.base[at - 1][:, None]
    regressors = [
        past_rows(walk, at, _PAST).reshape(len(at), -1),
        harmonics(walk.angle[at], _MEAN_ORDER),
        commands[:, :, 0].reshape(len(at), -1),
        pulse,
    ]
    z = np.concatenate(regressors, axis=1)
    later = [forced(walk, at + s, DEGREE) for s in range(hold, N, hold)]
    kw = pulse.shape[1]
    zw = np.stack([z.T @ w for w in later]) if later else np.zeros((0, z.shape[1], kw))
    zy = np.stack([z.T @ outputs_of(walk, at + lag) for lag in range(N)])
    return Sums(z.T @ z, zw, zy, len(at))
