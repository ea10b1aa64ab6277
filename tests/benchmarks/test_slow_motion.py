"""In slow motion all clocks of a process go by the same share, from an origin that all share."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.slow_motion import SlowTime, in_slow_motion
from quadriga.shared.runtime import clock
from quadriga.team.launch import ProcessSpec


def test_clocks_and_sleep_go_slower(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clock, "time", SlowTime(0.25))
    begun, wall, true = clock.monotonic_ns(), clock.wall_ns(), time.monotonic_ns()
    clock.sleep(0.02)
    took, went, really = (
        clock.monotonic_ns() - begun,
        clock.wall_ns() - wall,
        time.monotonic_ns() - true,
    )
    assert really >= 80_000_000
    assert took == pytest.approx(0.25 * really, rel=0.1)
    assert went == pytest.approx(0.25 * really, rel=0.1)
    assert clock.monotonic() == pytest.approx(0.25 * time.monotonic(), abs=0.1)


def test_a_process_of_the_table_runs_by_them(tmp_path: Path) -> None:
    told = "from quadriga.shared.runtime import clock\nprint(clock.monotonic())\n"
    (tmp_path / "teller.py").write_text(told, encoding="ascii")
    row = in_slow_motion(ProcessSpec("r1", (sys.executable, "-m", "teller"), 1.0), 0.5)
    path = os.pathsep.join([str(tmp_path), os.getcwd()])
    variables = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(row.command, env=variables, capture_output=True, text=True, check=True)
    assert float(done.stdout) == pytest.approx(0.5 * time.monotonic(), abs=10.0)
