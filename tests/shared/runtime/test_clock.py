"""The rate loop, on a clock that moves when it is told to."""

from __future__ import annotations

import time

import pytest

from quadriga.shared.runtime.clock import Rate, format_local, monotonic, sleep
from tests.manual_clock import ManualClock


def rate(clock: ManualClock) -> Rate:
    return Rate(0.01, clock.monotonic, clock.sleep)


def test_a_time_zone_that_there_is_not_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "UTC+25")
    time.tzset()
    try:
        assert format_local("%Y%m%d", 10**18) == "20010908"
    finally:
        monkeypatch.undo()
        time.tzset()


def test_a_punctual_loop_keeps_its_schedule() -> None:
    clock = ManualClock()
    loop = rate(clock)
    for _ in range(1000):
        clock.sleep(0.004)  # work
        assert loop.wait() == pytest.approx(0.0, abs=1e-9)
    assert clock.now == pytest.approx(10.0)
    assert loop.overruns == 0


def test_a_late_turn_is_counted_and_caught_up() -> None:
    clock = ManualClock()
    loop = rate(clock)
    clock.sleep(0.025)  # one turn that takes two and a half periods
    assert loop.wait() == pytest.approx(0.015)
    assert loop.overruns == 1
    for _ in range(3):
        loop.wait()
    assert clock.now == pytest.approx(0.04)
    assert (loop.overruns, loop.lost) == (1, 0.0)


def test_a_slightly_late_turn_is_no_overrun() -> None:
    clock = ManualClock()
    loop = rate(clock)
    clock.sleep(0.015)
    assert loop.wait() == pytest.approx(0.005)
    assert loop.overruns == 0


def test_after_a_long_freeze_the_schedule_moves() -> None:
    clock = ManualClock()
    loop = rate(clock)
    clock.sleep(60.0)
    assert loop.wait() == pytest.approx(59.99)
    assert loop.wait() == 0.0
    assert clock.now == pytest.approx(60.01)
    assert loop.overruns == 1
    assert loop.lost == pytest.approx(59.99)


def test_the_real_clock_passes() -> None:
    begun = monotonic()
    sleep(0.01)
    assert monotonic() - begun >= 0.01
    sleep(-1.0)  # in the past: at once
