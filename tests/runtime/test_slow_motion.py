"""In slow motion all clocks of a process go by the same share, from an origin that all share."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from quadriga.team.launch import ProcessSpec
from tests.runtime.conftest import in_slow_motion


def test_a_process_of_the_table_runs_by_them(tmp_path: Path) -> None:
    told = "from quadriga.shared.runtime import clock\nprint(clock.monotonic())\n"
    (tmp_path / "teller.py").write_text(told, encoding="ascii")
    row = in_slow_motion(ProcessSpec("r1", (sys.executable, "-m", "teller"), 1.0), 0.5)
    path = os.pathsep.join([str(tmp_path), os.getcwd()])
    variables = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(row.command, env=variables, capture_output=True, text=True, check=True)
    assert float(done.stdout) == pytest.approx(0.5 * time.monotonic(), abs=10.0)
