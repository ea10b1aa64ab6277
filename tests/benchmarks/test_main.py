"""The benchmark as its user starts it, with sizes that only show that all parts work."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.listening import await_true
from tests.quadriga.experiments.processes import await_gone, children

TOP = Path(__file__).parents[2]


def command(out: Path, *words: str) -> list[str]:
    return [sys.executable, "-m", "benchmarks", *words, "--quick", "--out", str(out)]


def run(out: Path, *words: str) -> tuple[str, dict[str, Any]]:
    done = subprocess.run(
        command(out, *words), cwd=TOP, check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout, json.loads(out.read_text(encoding="utf-8"))


def test_parts_print_their_lines_and_write_their_figures(tmp_path: Path) -> None:
    parts = ("low-level", "bus", "recorder")
    page, found = run(tmp_path / "b.json", *parts, "--planner", "none", "--robots", "1")
    assert all(name in page for name in parts)
    assert found["low_level_us_median"] > 0.0
    assert found["low_level_us_cold_median"] > 0.0  # which is the greater, a busy machine decides
    stages = found["parts"]["low-level"]["hot"]["stages"]
    share = sum(stages.values()) / found["low_level_us_median"]
    assert 0.3 < share < 3.0, "the stages, from passes of their own, make up the tick"
    assert min(stages.values()) > 0.0
    (row,) = found["parts"]["bus"]["rows"]
    assert row["bus"]["median"] > 0.0
    assert row["socket"]["median"] > 0.0
    assert found["recorder_gaps"] == 0
    assert found["recorder_msgs_per_s"] > 0.0
    assert found["machine"]["scheduling"] in ("realtime", "ordinary")
    assert found["rtf"] == {}
    assert found["failed"] == {}


@pytest.mark.nightly
def test_walks_are_measured_with_and_without_the_bus(tmp_path: Path) -> None:
    words = ("walks", "--planner", "none", "--robots", "1", "--seconds", "1")
    page, found = run(tmp_path / "b.json", *words)
    assert found["rtf"]["1"] > 0.0
    assert found["messaging_share"]["1"] < 1.0
    row = found["parts"]["walks"]["rows"][0]
    assert row["seconds"] == pytest.approx(1.0, abs=0.02)
    assert set(row["memory_mb"]) == {"sim", "r1", "operator", "recorder"}
    assert all(0.0 < m["pss"] <= m["rss"] for m in row["memory_mb"].values())
    assert "ENDED" not in page


def test_an_unknown_part_is_refused_by_name(tmp_path: Path) -> None:
    words = command(tmp_path / "b.json", "wrold")
    done = subprocess.run(words, cwd=TOP, check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert "no part wrold" in done.stderr


def test_an_interrupt_leaves_no_process_and_no_file(tmp_path: Path) -> None:
    words = command(tmp_path / "b.json", "bus")
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(words, cwd=TOP, text=True, **pipes) as bench:  # type: ignore[call-overload]
        await_true(lambda: len(children(bench.pid)) > 2)
        helpers = children(bench.pid)
        bench.send_signal(signal.SIGINT)
        _, errors = bench.communicate(timeout=20.0)
    assert bench.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    await_gone(helpers)
    assert not (tmp_path / "b.json").exists()
