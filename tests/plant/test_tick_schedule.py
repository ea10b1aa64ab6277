"""Ticks begin a millisecond apart, never jump or repeat, and what is late is caught up gently."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.plant.tick_schedule import LEAST_GAP_NS, TICK_NS, TickSchedule

MS = TICK_NS
FIRST = 7 * 10**9


def test_a_punctual_plant_keeps_whole_milliseconds() -> None:
    schedule = TickSchedule(FIRST)
    for k in range(100):
        at = schedule.plan(FIRST + k * MS)
        assert at == FIRST + k * MS
        assert schedule.begin(at) == 0


@given(st.lists(st.tuples(st.integers(-20 * MS, 20 * MS), st.integers(0, 30 * MS)), max_size=60))
def test_ticks_are_never_close_and_plans_never_jump(turns: list[tuple[int, int]]) -> None:
    """Whatever the clock is corrected by, and however late ticks begin."""
    schedule, begun, planned = TickSchedule(FIRST), FIRST - MS, FIRST - MS
    for k, (correction, lateness) in enumerate(turns):
        at = schedule.plan(FIRST + k * MS + correction)
        assert at >= max(begun + LEAST_GAP_NS, planned + MS // 2)
        assert MS // 2 <= schedule.planned - planned <= 3 * MS // 2
        planned, begun = schedule.planned, at + lateness
        assert schedule.begin(begun) == begun - planned


@pytest.mark.parametrize("correction", [MS, -MS, 20 * MS, -20 * MS])
def test_a_correction_is_made_smoothly(correction: int) -> None:
    """One of a millisecond by 50 µs a tick at most, and it is all gone in the end."""
    schedule, planned = TickSchedule(FIRST), FIRST - MS
    for k in range(300):
        schedule.begin(schedule.plan(FIRST + k * MS + correction))
        gap, planned = schedule.planned - planned, schedule.planned
        assert abs(gap - MS) <= max(abs(correction) // 20, 1) or abs(correction) > 10 * MS
    assert planned == pytest.approx(FIRST + 299 * MS + correction, abs=1000)


def test_a_stall_is_caught_up_by_half_a_millisecond_a_tick() -> None:
    schedule, now = TickSchedule(FIRST), FIRST
    late = []
    for k in range(50):
        now = max(schedule.plan(FIRST + k * MS), now) + (10 * MS if k == 20 else 0)
        late.append(schedule.begin(now))
    assert max(late) == 10 * MS
    assert late[20:41] == [10 * MS - k * MS // 2 for k in range(21)]
    assert not any(late[41:])


def test_time_that_slips_is_not_caught_up() -> None:
    schedule = TickSchedule(FIRST)
    schedule.plan(FIRST)
    schedule.slip(schedule.begin(FIRST + 9 * MS))
    assert schedule.plan(FIRST + 10 * MS) == FIRST + 10 * MS
