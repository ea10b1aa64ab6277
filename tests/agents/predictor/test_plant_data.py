"""Data that belong together, Hankel matrices of them, and what they excite."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.plant import Data, fit, is_persistently_exciting
from quadriga.shared.errors import PredictorError

U, Y = np.random.default_rng(0).normal(size=(30, 2)), np.zeros((30, 1))


@pytest.mark.parametrize(
    ("u", "y", "text"),
    [
        ([], [], r"data\.u: got no episode"),
        ([U], [Y, Y], "inputs of 1 episodes"),
        ([U], [Y[:20]], "as many samples"),
        ([U[:, 0]], [Y], r"data\.u: got shape \(30,\)"),
        ([U, U[:, :1]], [Y, Y], "alike in all episodes"),
        ([U[:, None]], [Y], "as many samples and agents"),
        ([U * np.inf], [Y], r"data\.u: got NaN or infinity"),
        ([["a"]], [Y], "an array of numbers"),
        ([U + 1j], [Y], r"data\.u: got complex numbers"),
        ([np.ma.masked_less(U, 0.0)], [Y], r"data\.u: got masked samples"),
        ([U * 1e200], [Y], r"data\.u: got .*e\+200, expected numbers up to"),
    ],
)
def test_data_that_do_not_belong_together_are_refused(u: Any, y: Any, text: str) -> None:
    with pytest.raises(PredictorError, match=text):
        Data(u, y)


def test_a_constant_input_is_refused_and_a_mean_is_warned_of() -> None:
    still = U.copy()
    still[:, 1] = 7.3
    with pytest.raises(PredictorError, match=r"data\.u: got columns \[1\] constant"):
        fit(Data(still, Y), kind="ridge", past=2, horizon=2)
    with pytest.warns(UserWarning, match=r"data\.y has a mean beyond .* no intercept"):
        fit(Data(U, U[:, :1] + 5.0), kind="ridge", past=2, horizon=2)


def test_data_are_copied_and_read_only() -> None:
    u = U.copy()
    data = Data(u, Y)
    u[:] = 0.0
    np.testing.assert_array_equal(data.u[0][:, 0], U)
    assert (data.agents, data.inputs, data.outputs, data.samples) == (1, 2, 1, 30)
    with pytest.raises(ValueError, match="read-only"):
        data.u[0][0] = 1.0
    with pytest.raises(PredictorError, match=r"data\.first"):
        Data(U, Y, first=[0, 1])


def test_noise_excites_and_a_sine_does_not() -> None:
    assert is_persistently_exciting(U, 10)
    assert not is_persistently_exciting(U, 11)  # 20 columns, 22 rows
    assert is_persistently_exciting([U, U[::-1]], 11)
    for wrong in (U[:1], U[:, 0], [U, U[:, :1]]):
        with pytest.raises(PredictorError, match="signal"):
            is_persistently_exciting(wrong, 3)
    sine = np.sin(0.3 * np.arange(60.0))[:, None]
    assert is_persistently_exciting(sine, 2)
    assert not is_persistently_exciting(sine, 3)
