"""Gram matrices of the Hankel columns that begin in each part of a cycle (the gait's period)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array


def cyclic_grams(
    signals: Sequence[Array], places: Sequence[int], L: int, part_of: NDArray[np.int64]
) -> Iterator[tuple[int, Array]]:
    """For each part: how many columns of `mosaic(signals, L)` lie in it, and their H Hᵀ.

    Column c of signal e has the place (places[e] + c) mod K in a cycle of K = len(part_of)
    columns. Blocks are computed from their neighbours as in `hankel.gram`, one place after the
    other: with A_k(d) the sum of w_c w_{c+d}ᵀ over the columns c at place k, block (a, a + d) of a
    part is the sum of A_{k+a}(d) over the part's places k, but for a few columns at the ends of
    each signal.

    Args:
        signals: per episode shape (T, q).
        places: of the first column of each.
        L: number of block rows.
        part_of: part of every place, 0 … P − 1.

    Yields:
        Count and Gram matrix, shape (L q, L q), of each part.
    """
    K, q = len(part_of), signals[0].shape[1]
    usable = [
        (np.ascontiguousarray(w), s) for w, s in zip(signals, places, strict=True) if len(w) >= L
    ]
    heads = np.zeros((K, q, L * q))
    for w, first in usable:
        for k in range(K):
            at = np.arange((k - first) % K, len(w) - L + 1, K)
            heads[k] += w[at].T @ _rows(w, at, L)
    for part in range(int(part_of.max()) + 1):
        mine = np.flatnonzero(part_of == part)
        count = sum(
            int((part_of[(first + np.arange(len(w) - L + 1)) % K] == part).sum())
            for w, first in usable
        )
        S = np.empty((L * q, L * q))
        for a in range(L):
            row = heads[(mine + a) % K, :, : (L - a) * q].sum(axis=0)
            for w, first in usable:
                M = len(w) - L + 1
                lost, new = (
                    c[part_of[(first + c) % K] == part] + a
                    for c in (np.arange(-a, 0), np.arange(M - a, M))
                )
                row += w[new].T @ _rows(w, new, L - a) - w[lost].T @ _rows(w, lost, L - a)
            S[a * q : (a + 1) * q, a * q :] = row
            S[a * q :, a * q : (a + 1) * q] = row.T
        yield count, S


def _rows(w: Array, at: NDArray[np.int64], length: int) -> Array:
    """Windows of `length` samples that begin at `at`. Shape (len(at), length · q)."""
    windows: Array = w[at[:, None] + np.arange(length)].reshape(len(at), length * w.shape[1])
    return windows
