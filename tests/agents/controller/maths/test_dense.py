"""Loops over small matrices against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.controller.maths.dense import (
    add_gram,
    cholesky,
    cholesky_solve,
    product,
    symmetrise,
    times,
    transposed_times,
)

size = st.integers(1, 18)


@given(m=size, k=size, n=size, seed=st.integers(0, 2**32 - 1))
def test_products(m: int, k: int, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, B, x, y = rng.normal(size=(m, k)), rng.normal(size=(k, n)), *rng.normal(size=(2, 18))
    np.testing.assert_allclose(times(A, x[:k]), A @ x[:k], atol=1e-12)
    np.testing.assert_allclose(transposed_times(A, y[:m]), A.T @ y[:m], atol=1e-12)
    np.testing.assert_allclose(product(A, B), A @ B, atol=1e-12)
    H = np.zeros((k, k))
    add_gram(2.5, A, H)
    symmetrise(H)
    np.testing.assert_allclose(H, 2.5 * A.T @ A, atol=1e-12)


@given(n=size, m=size, seed=st.integers(0, 2**32 - 1))
def test_solutions(n: int, m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n + 2))
    H, B = root @ root.T + np.eye(n), rng.normal(size=(n, m))
    L = cholesky(np.tril(H))  # only the lower triangle is read
    np.testing.assert_allclose(L @ L.T, H, atol=1e-11)
    X = B.copy()
    cholesky_solve(L, X)
    np.testing.assert_allclose(H @ X, B, atol=1e-9)


@pytest.mark.parametrize("H", [[[0.0]], [[1.0, 2.0], [2.0, 1.0]], [[np.nan]]])
def test_what_is_not_positive_definite_has_no_factor(H: list[list[float]]) -> None:
    assert np.isnan(cholesky(np.array(H))).any()
