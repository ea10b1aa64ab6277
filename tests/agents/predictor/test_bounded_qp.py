"""The QP of all plans: closed forms, and problems that have no answer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.control import BoundedQp
from quadriga.shared.errors import PredictorError


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), k=st.integers(1, 8), reach=st.floats(0.01, 2.0))
def test_a_separable_problem_is_cut_off_at_its_bounds(seed: int, k: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    H, f = np.diag(rng.uniform(0.5, 2.0, k)), rng.normal(size=k)
    qp = BoundedQp(H, np.zeros((0, k)))
    x, residual = qp.solve(f, np.full(k, -reach), np.full(k, 0.5 * reach))
    np.testing.assert_allclose(x, np.clip(-f / H.diagonal(), -reach, 0.5 * reach), atol=1e-9)
    assert residual < 1e-8


def test_the_nearest_point_of_a_half_plane() -> None:
    qp, free = BoundedQp(np.eye(2), np.array([[1.0, 1.0]])), np.full(2, np.inf)
    x, _ = qp.solve(np.zeros(2), np.append(-free, 2.0), np.append(free, np.inf))
    np.testing.assert_allclose(x, [1.0, 1.0], atol=1e-9)


def test_problems_without_an_answer_are_errors() -> None:
    with pytest.raises(PredictorError, match="orders of magnitude apart"):
        BoundedQp(np.diag([1.0, -1.0]), np.zeros((0, 2)))
    qp = BoundedQp(np.eye(1), np.ones((1, 1)))
    with pytest.raises(PredictorError, match="no solution"):
        qp.solve(np.zeros(1), np.array([-1.0, 2.0]), np.array([1.0, 3.0]))
