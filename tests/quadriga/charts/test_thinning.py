"""Curves are thinned out without losing peaks, and broken where there are gaps."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from quadriga.charts.panels import Curve
from quadriga.charts.thinning import find_spells, thin_out, visible_points

FINITE = st.floats(-1e3, 1e3)
VALUES = arrays.arrays(np.float64, st.integers(1, 400), elements=FINITE)


@given(VALUES, st.integers(2, 40))
def test_thinning_keeps_both_ends_and_every_extreme_and_the_order(
    y: np.ndarray, columns: int
) -> None:
    x = np.arange(len(y), dtype=float)
    kept_x, kept_y = thin_out(x, y, columns)
    assert len(kept_x) <= max(2 * columns + 4, min(len(y), 2 * columns))
    assert (np.diff(kept_x) > 0).all()
    np.testing.assert_array_equal(kept_y, y[kept_x.astype(int)])
    assert (kept_y.min(), kept_y.max()) == (y.min(), y.max())
    assert (kept_x[0], kept_x[-1]) == (x[0], x[-1])


def test_a_gap_splits_a_curve() -> None:
    time = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    x, y = visible_points(Curve(time, np.ones(5), "own", gap=0.5), 0.0, 2.0, 100)
    np.testing.assert_array_equal(x, [0.0, 0.1, 0.2, np.nan, 1.0, 1.1])
    np.testing.assert_array_equal(y, [1.0, 1.0, 1.0, np.nan, 1.0, 1.0])


def test_nothing_is_drawn_of_nothing() -> None:
    for values in (np.zeros(0), np.full(3, np.nan)):
        curve = Curve(np.arange(float(len(values))), values, "own", "step", 0.1)
        assert [len(part) for part in visible_points(curve, 0.0, 2.0, 100)] == [0, 0]


def test_a_step_holds_its_last_value_for_the_most_of_a_gap() -> None:
    curve = Curve(np.array([1.0, 2.0]), np.array([5.0, 4.0]), "own", "step", gap=2.0)
    x, y = visible_points(curve, 0.0, 4.0, 100)
    np.testing.assert_allclose(x, [1.0, 2.0, 3.4])
    np.testing.assert_array_equal(y, [5.0, 4.0, 4.0])


def test_spells() -> None:
    assert find_spells(np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)) == [(0, 2), (3, 4), (6, 7)]
    assert find_spells(np.zeros(3, dtype=bool)) == []
