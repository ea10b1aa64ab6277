"""A team of real processes is driven, stopped and timed; what was timed is not timed again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadriga.commands.parser import main

WAYS = ("silence", "page", "keyboard", "estop", "armed", "gamepad")
OPTIONS = (
    *("--robots", "1", "--planner", "none", "--tries", "1"),
    *("--set", "runtime.check_cpu=false"),
)


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime", "_compiled")
def test_a_press_is_timed_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, folder = tmp_path / "stops.json", tmp_path / "out"
    words = ["bench-stop", *WAYS, *OPTIONS, "--json", str(file), "--out", str(folder)]
    assert main(words) == 0, capsys.readouterr().err
    figures = json.loads(file.read_text(encoding="utf-8"))
    assert [figures[way]["stopped"] for way in WAYS] == [1] * len(WAYS)
    assert 0.0 < figures["page"]["p50_ms"] < 5000.0
    # 0.3 s of silence are waited for, then it slows down for half a second. A world that was late
    # makes up for up to 20 ms at a time, and is ahead of its own clock by so much.
    assert figures["silence"]["p50_ms"] > 700.0
    assert main([*words[:-4], "--out", str(folder)]) == 0
    assert len((folder / "rows.jsonl").read_text(encoding="utf-8").splitlines()) == len(WAYS)
