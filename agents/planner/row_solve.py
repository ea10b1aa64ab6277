"""Solution of a positive definite system of up to hundreds of rows, as compiled loops over rows.

The factor of `agents.controller.maths.dense` sums along rows, which suits a dozen. Here whole
rows are added up, several elements at a time, and still in an order that no processor changes.
"""

from __future__ import annotations

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled


@compiled
def solve(S: Array, x: Array) -> None:
    """Replace x, (k,), by S⁻¹ x, and the upper triangle of S, (k, k), by its factor U, S = Uᵀ U.

    NaN where S is not positive definite. Loops over rows give the same bits on every processor.
    """
    count = len(x)
    for b in range(count):
        row = S[b, b:]
        fours = b - b % 4
        for a in range(0, fours, 4):  # the row is loaded and stored once for four
            row0, row1, row2, row3 = S[a, b:], S[a + 1, b:], S[a + 2, b:], S[a + 3, b:]
            s0, s1, s2, s3 = row0[0], row1[0], row2[0], row3[0]
            for j in range(len(row)):
                row[j] -= s0 * row0[j] + s1 * row1[j] + s2 * row2[j] + s3 * row3[j]
        for a in range(fours, b):
            subtract(row, S[a, b], S[a, b:])
        pivot = np.sqrt(row[0]) if row[0] > 0.0 else np.nan
        for j in range(len(row)):
            row[j] /= pivot
        x[b] /= pivot
        subtract(x[b + 1 :], x[b], row[1:])
    for b in range(count - 1, -1, -1):
        rest, row = x[b + 1 :], S[b, b + 1 :]
        total = x[b]
        for j in range(len(rest)):
            total -= row[j] * rest[j]
        x[b] = total / S[b, b]


@compiled
def subtract(row: Array, factor: float, other: Array) -> None:
    """Subtract factor · other. Shapes (k,)."""
    for j in range(len(row)):
        row[j] -= factor * other[j]
