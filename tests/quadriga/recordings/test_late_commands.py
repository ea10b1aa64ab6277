"""The share of late commands between two reports of a world that counts from its begin."""

from __future__ import annotations

import pytest

from quadriga.plant.deadlines import Deadlines
from quadriga.recordings.late_commands import late_shares, overloaded


def report(deadlines: Deadlines, ages: dict[str, list[int]]) -> dict[str, int]:
    for robot, each in ages.items():
        for age in each:
            deadlines.note_age(robot, age)
    return dict(deadlines.status(1000, 0).counters)


def test_only_what_came_since_the_report_before_counts() -> None:
    world = Deadlines(["r1", "r2"])
    first = report(world, {"r1": [1] * 50 + [0] * 50, "r2": [0] * 100})
    second = report(world, {"r1": [0] * 100, "r2": [2] * 30 + [0] * 70})
    assert late_shares({}, first) == {"r1": 0.5, "r2": 0.0}
    assert late_shares(first, second) == {"r1": 0.0, "r2": pytest.approx(0.3)}
    assert late_shares(second, second) == {}
    assert overloaded(late_shares(first, second)) == {"r2": pytest.approx(0.3)}
