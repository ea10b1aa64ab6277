"""What is timed next, and what cannot be timed."""

from __future__ import annotations

import pytest

from quadriga.commands.parser import main
from quadriga.stop_times.bench import next_presses


def test_ways_take_turns_until_each_has_its_tries() -> None:
    rows = [{"way": "page"}, {"way": "page"}, {"way": "estop"}]
    assert next_presses([], ["page", "estop"], 2) == ["page", "estop"] * 2
    assert next_presses(rows, ["page", "estop"], 3) == ["page", "estop", "estop"]
    assert next_presses(rows, ["page"], 2) == []
    assert len(next_presses([], ["page"], 100)) < 20, "a walk is not endless"


def test_what_cannot_be_is_said_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    for words, got in (
        (("whistle",), "way: got 'whistle'"),
        (("--tries", "0"), "--tries: got 0"),
        (("--set", "team.plant_per_robot=true", "--yokes", "none"), "team.plant"),
    ):
        assert main(["bench-stop", *words]) == 2
        assert got in capsys.readouterr().err
