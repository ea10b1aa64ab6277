"""Names of what is where in flat rows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from quadriga.agents.controller.acting import TASK
from quadriga.agents.controller.maths.rows import numbers, places, row_size
from quadriga.agents.controller.memory import MEMORY, MEMORY_SIZE
from quadriga.agents.controller.schedule import SCHEDULE
from quadriga.agents.controller.sensed import SENSED, SENSED_SIZE
from quadriga.shared.runtime.jit import compiled


class Sum(NamedTuple):
    a: float
    b: float
    c: float


@compiled
def weighed(row: np.ndarray) -> float:
    parts = Sum(*numbers(row, 3))
    return parts.a + 10.0 * parts.b + 100.0 * parts.c


def test_places_follow_each_other_and_a_single_number_has_an_index() -> None:
    found = places(a=3, b=1, c=2, d=1)
    assert found == {"a": slice(0, 3), "b": 3, "c": slice(4, 6), "d": 6}


@pytest.mark.parametrize("layout", [MEMORY, SENSED, SCHEDULE, TASK])
def test_every_number_of_a_row_has_one_name(layout: NamedTuple) -> None:
    count = np.zeros(row_size(layout))
    for place in layout:
        count[place] += 1.0
    np.testing.assert_array_equal(count, 1.0)


def test_rows_are_as_long_as_their_last_part_says() -> None:
    assert row_size(MEMORY) == MEMORY_SIZE == MEMORY.yaw_drift + 1
    assert row_size(SENSED) == SENSED_SIZE == SENSED.foot_load.stop


def test_a_row_becomes_a_tuple_within_compiled_code() -> None:
    assert weighed(np.array([1.0, 2.0, 3.0])) == 321.0
