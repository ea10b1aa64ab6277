"""Curves as paths: thinned out without losing peaks, broken where there are gaps."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from quadriga.report import path

FINITE = st.floats(-1e3, 1e3)
VALUES = arrays.arrays(np.float64, st.integers(1, 400), elements=FINITE)


@given(VALUES, st.integers(2, 40))
def test_thinning_keeps_both_ends_and_every_extreme_and_the_order(
    y: np.ndarray, columns: int
) -> None:
    x = np.arange(len(y), dtype=float)
    kept_x, kept_y = path.thinned(x, y, columns)
    assert len(kept_x) <= max(2 * columns + 4, min(len(y), 2 * columns))
    assert (np.diff(kept_x) > 0).all()
    np.testing.assert_array_equal(kept_y, y[kept_x.astype(int)])
    assert (kept_y.min(), kept_y.max()) == (y.min(), y.max())
    assert (kept_x[0], kept_x[-1]) == (x[0], x[-1])


def absolute(d: str) -> list[tuple[float, float]]:
    """Points of a path of `path.line`."""
    head, _, rest = d[1:].partition("l")
    numbers = [int(word) for word in re.findall(r"-?\d+", f"{head} {rest}")]
    return list(zip(np.cumsum(numbers[::2]), np.cumsum(numbers[1::2]), strict=True))


@given(VALUES)
def test_a_line_goes_through_its_points_to_a_tenth_of_a_pixel(y: np.ndarray) -> None:
    x = np.arange(len(y), dtype=float)
    d = path.line(x, y)
    if len(y) > 1:
        np.testing.assert_allclose(absolute(d), 10 * np.stack([x, y], axis=1), atol=0.5)
    else:
        assert d.endswith("h0")


def test_a_gap_splits_a_curve() -> None:
    time = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    x, y = path.broken(time, np.ones(5), 0.5)
    assert [len(part) for part, _ in path.segments(x, y)] == [3, 2]
    assert path.segments(np.zeros(0), np.zeros(0)) == []


def test_spells() -> None:
    assert path.spells(np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)) == [(0, 2), (3, 4), (6, 7)]
    assert path.spells(np.zeros(3, dtype=bool)) == []


def test_a_staircase_holds_each_value_until_the_next() -> None:
    assert path.staircase(np.array([1.0, 2.0]), np.array([5.0, 4.0]), 3.0) == "M10 50h10v-10H30"
