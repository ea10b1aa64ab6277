"""Products and solutions of matrices of a dozen rows, as compiled loops.

At these sizes a call of BLAS costs more than its arithmetic, most of all when its code and
buffers have left the caches; and loops give the same bits on every processor.
"""

from __future__ import annotations

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled


@compiled
def dot(x: Array, y: Array) -> float:
    """xᵀ y. Shapes (k,), (k,)."""
    total = 0.0
    for k in range(len(x)):
        total += x[k] * y[k]
    return total


@compiled
def times(A: Array, x: Array) -> Array:
    """A x. Shapes (m, k), (k,)."""
    y = np.zeros(A.shape[0])
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            y[i] += A[i, k] * x[k]
    return y


@compiled
def transposed_times(A: Array, x: Array) -> Array:
    """Aᵀ x. Shapes (k, m), (k,)."""
    y = np.zeros(A.shape[1])
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            y[i] += A[k, i] * x[k]
    return y


@compiled
def product(A: Array, B: Array) -> Array:
    """A B. Shapes (m, k), (k, n)."""
    C = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            a = A[i, k]
            for j in range(B.shape[1]):
                C[i, j] += a * B[k, j]
    return C


@compiled
def add_gram(weight: float, A: Array, H: Array) -> None:
    """Add weight · Aᵀ A to the lower triangle of H. Shapes (k, n), (n, n)."""
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            a = weight * A[k, i]
            for j in range(i + 1):
                H[i, j] += a * A[k, j]


@compiled
def symmetrise(H: Array) -> None:
    """Copy the lower triangle of H to the upper one."""
    for i in range(H.shape[0]):
        for j in range(i):
            H[j, i] = H[i, j]


@compiled
def cholesky(H: Array) -> Array:
    """The lower Cholesky factor of H, (n, n), of which the lower triangle is read.

    NaN where H is not positive definite.
    """
    n = H.shape[0]
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                L[i, i] = np.sqrt(total) if total > 0.0 else np.nan
            else:
                L[i, j] = total / L[j, j]
    return L


@compiled
def cholesky_solve(L: Array, B: Array) -> None:
    """Replace B, (n, m), by (L Lᵀ)⁻¹ B."""
    n, m = B.shape
    for i in range(n):
        for k in range(i):
            for j in range(m):
                B[i, j] -= L[i, k] * B[k, j]
        for j in range(m):
            B[i, j] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            for j in range(m):
                B[i, j] -= L[k, i] * B[k, j]
        for j in range(m):
            B[i, j] /= L[i, i]
