"""Block Hankel matrices of one or several episodes (eq. 2, 4), and their Gram matrix."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from quadriga.shared.robots.conventions import Array


def hankel(signal: Array, L: int) -> Array:
    """H_L of eq. 2 of a signal (T, m), T ≥ L: column c stacks samples c … c+L−1.

    Shape (m L, T − L + 1).
    """
    windows = sliding_window_view(signal, L, axis=0)  # (M, m, L)
    return windows.transpose(2, 1, 0).reshape(L * signal.shape[1], -1)


def mosaic(signals: Iterable[Array], L: int) -> Array:
    """The Hankel matrices of several episodes side by side; no column straddles two of them.

    Episodes shorter than L have no column.
    """
    return np.concatenate([hankel(signal, L) for signal in signals if len(signal) >= L], axis=1)


def split(u: Sequence[Array], y: Sequence[Array], T_ini: int, N: int) -> tuple[Array, ...]:
    """U_p, Y_p, U_f and Y_f of the Hankel matrices of several episodes (eq. 4).

    Inputs u are (T, m), outputs y (T, p) of each; T_ini samples of the past, N of the future.
    """
    U, Y = mosaic(u, T_ini + N), mosaic(y, T_ini + N)
    m, p = u[0].shape[1], y[0].shape[1]
    return U[: m * T_ini], Y[: p * T_ini], U[m * T_ini :], Y[p * T_ini :]


def required_samples(m: int, T_ini: int, N: int, n: int) -> int:
    """Least T for a sufficiently rich Hankel matrix, (m+1)(T_ini+N+n)−1; n is the order."""
    return (m + 1) * (T_ini + N + n) - 1


def gram(signals: Sequence[Array], L: int) -> Array:
    """H Hᵀ of H = mosaic(signals, L), without forming H. Shape (L q, L q) for signals (T, q).

    Each block follows from the one diagonally before it,
    S(a+1, b+1) = S(a, b) + w_{a+M} w_{b+M}ᵀ − w_a w_bᵀ with M columns, so only the first block row
    needs products over all samples.
    """
    q = signals[0].shape[1]
    S = np.zeros((L * q, L * q))
    episodes = [(np.ascontiguousarray(w), len(w) - L + 1) for w in signals if len(w) >= L]
    for w, M in episodes:
        for b in range(L):
            S[:q, b * q : (b + 1) * q] += w[:M].T @ w[b : b + M]
    for a in range(L - 1):
        row = S[(a + 1) * q : (a + 2) * q, (a + 1) * q :]
        row[:] = S[a * q : (a + 1) * q, a * q : (L - 1) * q]
        for sign, windows in (
            (1.0, [w[a + M :] for w, M in episodes]),
            (-1.0, [w[a : L - 1] for w, _ in episodes]),
        ):
            first = np.stack([window[0] for window in windows])
            row += sign * (first.T @ np.stack([window.ravel() for window in windows]))
    for a in range(L - 1):
        S[(a + 1) * q :, a * q : (a + 1) * q] = S[a * q : (a + 1) * q, (a + 1) * q :].T
    return S
