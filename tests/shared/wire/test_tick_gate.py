"""Time goes on; a jump needs a second word."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.wire.tick_gate import TickGate


def taken(*ticks: int, step: int = 100, most: int = 5000) -> list[int]:
    """Which of them are believed."""
    gate = TickGate(step, most)
    return [tick for tick in ticks if gate.take(tick)]


def test_ticks_that_rise_by_little_are_believed() -> None:
    assert taken(0, 1, 2, 102, 202) == [0, 1, 2, 102, 202]
    assert taken(0, 1, 1, 0, 2) == [0, 1, 2]


@pytest.mark.parametrize("forged", [102, 5000, 1 << 41])
def test_one_forged_tick_makes_no_true_one_late(forged: int) -> None:
    assert taken(0, 1, forged, 2, 3, forged + 7, 4) == [0, 1, 2, 3, 4]


def test_a_jump_is_believed_once_another_goes_on_from_it() -> None:
    assert taken(0, 1, 1000, 1001, 1002) == [0, 1, 1001, 1002]
    assert taken(0, 1000, 1000, 1101, 1102) == [0, 1102], "the same again, and too far, are no word"


def test_no_jump_beyond_what_is_possible() -> None:
    assert taken(0, 5000, 5001, 5002) == [0]
    assert taken(0, 4990, 4991) == [0, 4991]


def test_the_first_may_be_of_any_time_but_not_alone() -> None:
    assert taken(1 << 41, 0, 1) == [0, 1]
    assert taken(1 << 41, (1 << 41) + 1) == [(1 << 41) + 1]


def test_a_replay_trusts_what_was_taken() -> None:
    gate = TickGate(100, 5000)
    for tick in (0, 700, 9000):
        gate.trust(tick)
        assert gate.take(tick)
    assert not gate.take(8999)


@given(st.lists(st.integers(0, 20_000), max_size=30))
def test_what_is_believed_only_rises(ticks: list[int]) -> None:
    believed = taken(*ticks)
    assert believed == sorted(set(believed))
