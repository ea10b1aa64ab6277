"""What a world in real time counts, and the share of late commands between two of its reports."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.plant.deadlines import Deadlines
from quadriga.recordings.late_commands import late_shares, overloaded
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Status


def report(deadlines: Deadlines, ages: dict[str, list[int]]) -> dict[str, int]:
    for robot, each in ages.items():
        for age in each:
            deadlines.note_command(robot, age)
    return dict(deadlines.status(1000, 0).counters)


def test_only_what_came_since_the_report_before_counts() -> None:
    world = Deadlines(["r1", "r2"])
    first = report(world, {"r1": [1] * 50 + [0] * 50, "r2": [0] * 100})
    second = report(world, {"r1": [0] * 100, "r2": [2] * 30 + [0] * 70})
    assert late_shares({}, first) == {"r1": 0.5, "r2": 0.0}
    assert late_shares(first, second) == {"r1": 0.0, "r2": pytest.approx(0.3)}
    assert late_shares(second, second) == {}
    assert overloaded(late_shares(first, second)) == {"r2": pytest.approx(0.3)}


def test_ages_of_commands_and_lateness_of_the_world_are_told() -> None:
    deadlines = Deadlines(("r1", "r2"))
    for tick in range(200):
        deadlines.note_command("r1", 0)
        deadlines.note_command("r2", 3 if tick % 4 == 0 else 0, held=tick < 2)
        deadlines.note_lateness(5e-3 if tick == 100 else 1e-4)
    status = deadlines.status(200, overruns=1)
    counters = {"overruns": 1, "ticks": 200, "r1.due": 200, "r2.due": 200, "r1.late": 0}
    counters |= {"r2.late": 50, "r1.held": 0, "r2.held": 2}
    assert decode(encode(status), Status).counters == counters
    assert deadlines.describe_late() == "r1 0 held 0, r2 50 held 2"
    assert status.ages_ms["r1.command.max"] == 0.0
    assert [status.ages_ms[f"r2.command.{q}"] for q in ("median", "p99", "max")] == [0.0, 3.0, 3.0]
    assert abs(status.ages_ms["jitter.median"] - 0.1) <= 0.02
    assert status.ages_ms["jitter.max"] == 5.0
    assert len(status.tick_us) == 200
    assert np.max(status.tick_us) == 5000.0
    assert len(deadlines.status(201, 1).tick_us) == 0  # each lateness is told once
