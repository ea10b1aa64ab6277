"""The rate loop, on a clock that moves when it is told to."""

from __future__ import annotations

import pytest

from quadriga.shared.runtime.clock import Rate
from tests.manual_clock import ManualClock


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def loop(clock: ManualClock) -> Rate:
    return Rate(0.01, clock.monotonic, clock.sleep)


def test_a_punctual_loop_keeps_its_schedule(clock: ManualClock, loop: Rate) -> None:
    for _ in range(1000):
        clock.sleep(0.004)  # work
        assert loop.wait() == pytest.approx(0.0, abs=1e-9)
    clock.sleep(0.015)
    assert loop.wait() == pytest.approx(0.005)  # slightly late: no overrun
    assert clock.now == pytest.approx(10.015)
    assert loop.overruns == 0


def test_a_late_turn_is_counted_and_caught_up(clock: ManualClock, loop: Rate) -> None:
    clock.sleep(0.025)  # one turn that takes two and a half periods
    assert loop.wait() == pytest.approx(0.015)
    assert loop.overruns == 1
    for _ in range(3):
        loop.wait()
    assert clock.now == pytest.approx(0.04)
    assert (loop.overruns, loop.lost) == (1, 0.0)


def test_after_a_long_freeze_the_schedule_moves(clock: ManualClock, loop: Rate) -> None:
    clock.sleep(60.0)
    assert loop.wait() == pytest.approx(59.99)
    assert loop.wait() == 0.0
    assert clock.now == pytest.approx(60.01)
    assert loop.overruns == 1
    assert loop.lost == pytest.approx(59.99)
