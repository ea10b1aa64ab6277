"""A playback's position moves with the clock at its rate, stands while paused, and steps."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.playback.transport import Transport

times = st.floats(0.0, 1e3)


@given(st.floats(0.01, 100.0), st.lists(st.tuples(times, st.booleans()), max_size=8))
def test_the_position_grows_by_rate_times_the_time_not_paused(
    rate: float, spans: list[tuple[float, bool]]
) -> None:
    transport = Transport(rate, 50.0, 0.0, paused=False)
    now = running = 0.0
    for span, toggled in spans:
        running += 0.0 if transport.paused else span
        now += span
        assert transport.position(now) == pytest.approx(50.0 + 1000 * rate * running, abs=1e-3)
        if toggled:
            transport.toggle(now)


@given(st.floats(0.01, 100.0), times, times)
def test_what_is_due_is_reached_then_and_not_before(rate: float, now: float, ahead: float) -> None:
    transport = Transport(rate, 0.0, now, paused=False)
    left = transport.until(ahead, now)
    assert transport.position(now + left) == pytest.approx(ahead, abs=1e-3)


def test_a_step_pauses_further_on() -> None:
    transport = Transport(2.0, 0.0, 10.0, paused=False)
    transport.step(40.0, 10.5)
    assert transport.paused
    assert transport.position(99.0) == 1040.0
    assert transport.until(1041.0, 99.0) == float("inf")
    assert transport.until(1040.0, 99.0) == 0.0
    transport.toggle(100.0)
    assert transport.position(101.0) == 3040.0


def test_who_is_much_too_late_does_not_race_afterwards() -> None:
    transport = Transport(2.0, 0.0, 0.0, paused=False)
    transport.fall_behind(100.0, 0.2, 0.2)  # 0.15 s late
    assert transport.position(0.2) == 400.0
    transport.fall_behind(100.0, 0.2, 1.0)
    assert transport.position(1.0) == 100.0
    transport.step(500.0, 1.0)
    transport.fall_behind(100.0, 0.2, 1.0)
    assert transport.position(1.0) == 600.0, "a step is no delay"
