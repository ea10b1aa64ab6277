"""When a team had stopped after a press, by what was heard; the figures of many tries."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.shared import codes
from quadriga.shared.codec import encode
from quadriga.shared.messages import Event, Message, Status
from quadriga.shared.topics import EVENT
from quadriga.stop_times.figures import StopPress, build_stop_table, find_stops, sum_up
from quadriga.stop_times.page import PAGE, renewed, stop_table

MS = 1_000_000
ROBOTS = ("r1", "r2")
_NONE = np.zeros(0)
STOPPED = Event.of(5, codes.ESTOPPED, "", "dog: every joint is damped")


def status(mode: str) -> Status:
    return Status(5, 0, mode, "", "kalman", {}, {}, planner_ms=_NONE, tick_us=_NONE)


def heard(*messages: tuple[float, str, Message]) -> list[tuple[int, str, bytes]]:
    """What was heard, by ms, key and message."""
    return [(round(ms * MS), f"team/{key}", encode(message)) for ms, key, message in messages]


def test_a_team_has_stopped_when_the_last_agent_and_the_plant_have() -> None:
    said = heard(
        (1, "r1/status", status("estop")),  # before anybody pressed
        (12, "r1/status", status("walk")),
        (13, EVENT.name, Event.of(5, codes.LIES, "r1", "")),
        (14, "r2/status", status("estop")),
        (15, "r1/status", status("stand")),
        (16.5, EVENT.name, STOPPED),
        (18.25, "r1/status", status("estop")),
        (30, "r2/status", status("estop")),
    )
    press = [StopPress("page", 10 * MS)]
    assert find_stops(said, press, ROBOTS, frozenset()) == [pytest.approx(8.25)]
    for gone in (3, 5, 6):
        some = [arrival for n, arrival in enumerate(said[:-1]) if n != gone]
        assert find_stops(some, press, ROBOTS, frozenset()) == [None]


def test_each_press_has_the_time_until_the_next_one() -> None:
    said = heard(
        (11, EVENT.name, STOPPED),
        (12, "r1/status", status("estop")),
        (14, "r2/status", status("estop")),
        (21, "r1/status", status("walk")),
        (22, "r1/status", status("stopping")),
        (23, "r2/status", status("stand")),
        (27, "r1/status", status("stand")),
        (41, EVENT.name, STOPPED),
        (42, "r1/status", status("estop")),
    )
    ways = (("page", 10), ("silence", 20), ("estop", 40))
    presses = [StopPress(way, at * MS) for way, at in ways]
    found = find_stops(said, presses, ROBOTS, frozenset({"silence"}))
    assert found == [pytest.approx(4.0), pytest.approx(7.0), None]
    assert find_stops([], presses, ROBOTS, frozenset()) == [None] * 3


def test_figures_are_of_those_tries_that_stopped_the_team() -> None:
    figures = sum_up({"page": [*map(float, range(1, 102)), None], "silence": [None]})
    assert figures["page"] == {
        "tries": 102,
        "stopped": 101,
        "p50_ms": 51.0,
        "p99_ms": 100.0,
        "max_ms": 101.0,
    }
    assert figures["silence"]["max_ms"] is None
    table = build_stop_table(figures)
    assert [row[0] for row in table.rows] == ["page", "silence"]
    assert table.rows[0][1:] == ("102", "101", "51", "100", "101")


def test_published_times_are_those_of_the_rows() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page, "run `make docs`"
    assert "| page |" in stop_table()
