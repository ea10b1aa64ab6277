"""Hankel matrices: structure, the sliding Gram matrix, what excites."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.predictor.hankel import gram, hankel, mosaic, required_samples, split
from quadriga.agents.predictor.regression import check_excitation
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

SEED = st.integers(0, 2**32 - 1)
NOISE = np.random.default_rng(0).normal(size=(400, 3))


def test_hankel_is_equation_2_and_split_is_equation_4() -> None:
    u, y = np.arange(12.0).reshape(6, 2), np.arange(6.0)[:, None]
    expected = [[0, 2, 4], [1, 3, 5], [2, 4, 6], [3, 5, 7], [4, 6, 8], [5, 7, 9]]
    np.testing.assert_array_equal(hankel(u[:5], 3), expected)
    U_p, Y_p, U_f, Y_f = split([u], [y], T_ini=2, N=3)
    np.testing.assert_array_equal(np.vstack([U_p, U_f]), hankel(u, 5))
    np.testing.assert_array_equal(np.vstack([Y_p, Y_f]), hankel(y, 5))
    assert (U_p.shape, Y_f.shape) == ((4, 2), (3, 2))


@given(SEED, st.integers(1, 4), st.integers(2, 6), st.integers(0, 20))
def test_a_block_row_is_the_row_above_shifted_by_one_sample(
    seed: int, m: int, L: int, extra: int
) -> None:
    H = hankel(np.random.default_rng(seed).normal(size=(L + extra, m)), L)
    assert H.shape == (m * L, extra + 1)
    np.testing.assert_array_equal(H[m:, :-1], H[:-m, 1:])


@given(SEED, st.integers(1, 3), st.integers(1, 6), st.lists(st.integers(0, 15), max_size=3))
def test_the_sliding_gram_matrix_is_that_of_the_explicit_hankel_matrix(
    seed: int, q: int, L: int, extras: list[int]
) -> None:
    rng = np.random.default_rng(seed)
    signals = [rng.normal(size=(L + extra, q)) for extra in [3, *extras]]
    short = rng.normal(size=(L - 1, q))  # has no column
    H = mosaic([short, *signals], L)
    assert H.shape[1] == mosaic(signals, L).shape[1]
    np.testing.assert_allclose(gram([short, *signals], L), H @ H.T, atol=1e-10)


def test_no_column_straddles_two_episodes() -> None:
    H = mosaic([np.full((6, 1), 1.0), np.full((6, 1), 2.0)], 3)
    assert set(H.ravel()) == {1.0, 2.0}
    assert (np.ptp(H, axis=0) == 0).all()


@pytest.mark.parametrize(("robots", "samples"), [(5, 5794), (10, 18754)])
def test_required_samples_of_large_teams(robots: int, samples: int) -> None:
    assert required_samples(12 * robots, 10, 25, 12 * robots) == samples


SINE = np.sin(0.7 * np.arange(200))[:, None]


@pytest.mark.parametrize(
    ("inputs", "order"),
    [
        ([NOISE[:35, :2]], 12),  # by the rule (m+1)(L+n)−1 of m = 2 inputs
        ([NOISE[:25, :2], NOISE[25:60, :2]], 10),  # together they excite
        ([SINE], 2),
    ],
)
def test_what_excites_up_to_an_order_does_not_beyond(inputs: list[Array], order: int) -> None:
    assert required_samples(2, 3, 4, 5) == 35
    check_excitation(inputs, order)
    for less, more in (
        ([inputs[0][:-1] if len(inputs) == 1 else inputs[0]], order + (inputs[0] is SINE)),
        ([np.hstack([each, 0.0 * each]) for each in inputs], order),
    ):
        with pytest.raises(PredictorError, match=f"persistently exciting of order {more}"):
            check_excitation(less, more)
