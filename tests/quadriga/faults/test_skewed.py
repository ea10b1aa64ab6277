"""A process whose clocks go wrong reads them so, and nobody else does."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from quadriga.faults import skewed
from quadriga.faults.skewed import SkewedTime
from quadriga.shared.runtime import clock
from quadriga.shared.runtime.clock import wall_ns

SECOND = 1_000_000_000


class TrueClocks:
    """Clocks that go on when they are told to."""

    def __init__(self) -> None:
        self.now, self.slept = 5 * SECOND, 0.0

    def monotonic_ns(self) -> int:
        return self.now

    def time_ns(self) -> int:
        return 100 * SECOND + self.now

    def sleep(self, seconds: float) -> None:
        self.slept += seconds


def test_a_step_is_of_the_wall_clock_alone() -> None:
    true = TrueClocks()
    clocks = SkewedTime(true.monotonic_ns, true.time_ns, true.sleep, time.thread_time_ns)
    clocks.set(-3600.0, 0.0)
    assert clocks.monotonic_ns() == true.now
    assert clocks.time_ns() == true.time_ns() - 3600 * SECOND


def test_a_clock_that_runs_fast_is_ahead_the_more_the_later_it_is_and_never_jumps() -> None:
    true = TrueClocks()
    clocks = SkewedTime(true.monotonic_ns, true.time_ns, true.sleep, time.thread_time_ns)
    true.now += SECOND
    clocks.set(0.0, 0.5)
    assert clocks.monotonic_ns() == true.now
    true.now += SECOND
    assert clocks.monotonic() == pytest.approx(7.5)
    assert clocks.time_ns() == true.time_ns() + SECOND // 2
    clocks.set(0.0, 0.0)
    assert clocks.monotonic() == pytest.approx(7.5)
    true.now += SECOND
    assert clocks.monotonic() == pytest.approx(8.5)


def test_sleep_is_by_the_clock_that_goes_wrong() -> None:
    true = TrueClocks()
    clocks = SkewedTime(true.monotonic_ns, true.time_ns, true.sleep, time.thread_time_ns)
    clocks.set(0.0, 0.25)
    clocks.sleep(1.0)
    assert true.slept == pytest.approx(0.8)


def test_all_that_the_project_asks_of_the_time_is_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    true = TrueClocks()
    clocks = SkewedTime(true.monotonic_ns, true.time_ns, true.sleep, time.thread_time_ns)
    monkeypatch.setattr(clock, "time", clocks)
    asked = set(re.findall(r"\btime\.(\w+)", inspect.getsource(clock)))
    assert asked >= {"monotonic_ns", "thread_time_ns"}
    assert not [name for name in asked if not hasattr(clocks, name)]
    assert clock.thread_ns() <= clock.thread_ns()


def test_a_command_reads_the_clock_that_a_file_and_a_signal_set(tmp_path: Path) -> None:
    file = tmp_path / "clock"
    file.write_text("3600 0", encoding="ascii")
    module = "tests.quadriga.faults.clock_reader"
    words = [sys.executable, "-m", skewed.__name__, str(file), module, str(file)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    ahead, right = (int(line) for line in done.stdout.split())
    assert ahead - wall_ns() == pytest.approx(3600 * SECOND, abs=60 * SECOND)
    assert right - wall_ns() == pytest.approx(0, abs=60 * SECOND)
