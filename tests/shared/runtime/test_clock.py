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


@pytest.mark.parametrize(
    ("work", "late", "next_late", "after_three"),
    [
        (0.025, 0.015, 0.005, 0.04),  # two and a half periods: caught up
        (60.0, 59.99, 0.0, 60.03),  # a freeze: the schedule moves
    ],
)
def test_a_late_turn_is_counted(
    clock: ManualClock, loop: Rate, work: float, late: float, next_late: float, after_three: float
) -> None:
    clock.sleep(work)
    assert loop.wait() == pytest.approx(late)
    assert loop.wait() == pytest.approx(next_late)
    loop.wait()
    loop.wait()
    assert clock.now == pytest.approx(after_three)
    assert loop.overruns == 1
