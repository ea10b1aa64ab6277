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
        schedule.begin(at)


@given(st.lists(st.tuples(st.integers(-20 * MS, 20 * MS), st.integers(0, 30 * MS)), max_size=60))
def test_ticks_are_never_close_and_never_jump(turns: list[tuple[int, int]]) -> None:
    """Whatever the clock is corrected by, and however late ticks begin."""
    schedule, begun, planned = TickSchedule(FIRST), FIRST - MS, FIRST - MS
    for k, (correction, lateness) in enumerate(turns):
        at = schedule.plan(FIRST + k * MS + correction)
        assert at >= max(begun + LEAST_GAP_NS, planned + MS // 2)
        assert at <= max(begun, planned) + 4 * MS
        planned, begun = schedule.planned, at + lateness
        schedule.begin(begun)


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
    schedule, now, late = TickSchedule(FIRST), FIRST, []
    for k in range(50):
        due = FIRST + k * MS
        now = max(schedule.plan(due), now) + (10 * MS if k == 20 else 0)
        schedule.begin(now)
        late.append(now - due)
    assert max(late) == 10 * MS
    assert late[20:41] == [10 * MS - k * MS // 2 for k in range(21)]
    assert not any(late[41:])


@pytest.mark.parametrize("delayed", [3 * MS, 9 * MS])
def test_what_is_late_already_takes_part_of_a_delay_at_once(delayed: int) -> None:
    """It began 9 ms late; then all of the team's time is delayed."""
    schedule = TickSchedule(FIRST)
    schedule.plan(FIRST)
    schedule.begin(FIRST + 9 * MS)
    late, now = [], FIRST + 9 * MS
    for k in range(1, 30):
        due = FIRST + k * MS + delayed
        now = schedule.plan(due)
        schedule.begin(now)
        late.append(now - due)
    assert late == [max(9 * MS - delayed - k * MS // 2, 0) for k in range(1, 30)]
