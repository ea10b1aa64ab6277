"""Values of axes are round, within, evenly spaced, and have room."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadriga.report.axis import decades, grid, nice


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e4), st.integers(1, 12))
def test_nice_values_are_round_and_within(low: float, width: float, count: int) -> None:
    found = nice(low, low + width, count)
    slack = 1e-6 * (abs(low) + width)
    assert all(low - slack <= value <= low + width + slack for value in found)
    assert len(found) <= count + 1
    steps = np.diff(found)
    np.testing.assert_allclose(steps, steps[:1].repeat(len(steps)), rtol=1e-3, atol=slack)


@given(st.floats(-1e3, 1e3), st.floats(1e-2, 1e3), st.floats(40.0, 900.0))
def test_a_grid_has_room_for_its_names(low: float, width: float, length: float) -> None:
    found = grid(low, low + width, length, 15.0)
    assert found == sorted(found)
    if len(found) > 2:
        assert length * (found[1] - found[0]) / width >= 10.0


def test_decades_are_refined_where_there_are_few() -> None:
    assert [v for v in decades(-1.0, 0.0) if 0.1 <= v <= 1.0] == [0.1, 0.2, 0.5, 1.0]
    assert [v for v in decades(0.0, 3.0) if v <= 1000.0] == [1.0, 10.0, 100.0, 1000.0]
