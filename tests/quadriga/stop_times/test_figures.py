"""When a team had stopped after a press, by ticks and the clock; the figures of many tries."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.plant.late import damp_joints
from quadriga.shared.recording.mcap_chunk import ChunkEntry
from quadriga.shared.wire import codes
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import Command, Event, Message, Status
from quadriga.shared.wire.topics import EVENT
from quadriga.stop_times.figures import StopPress, build_stop_table, find_stops, sum_up
from quadriga.stop_times.tick_times import TickTimes

MS = 1_000_000
ROBOTS = ("r1", "r2")
_NONE = np.zeros(0)
DAMPED = damp_joints(5)
HELD = Command.from_row(5, 0, np.ones_like(DAMPED.row))
STOPPED = Event.of(5, codes.ESTOPPED, "", "dog: every joint is damped")


def status(mode: str) -> Status:
    return Status(5, 0, mode, "", "kalman", {}, {}, planner_ms=_NONE, tick_us=_NONE)


TIMES = TickTimes(f"{tick} {tick * MS + 7}" for tick in range(100))


def recorded(*messages: tuple[int, str, Message]) -> list[ChunkEntry]:
    """Entries of a recording, by tick, key and message; it lags by 3 s."""
    return [
        ChunkEntry(f"team/{key}", tick, 3000 * MS, encode(message))
        for tick, key, message in messages
    ]


def test_a_team_has_stopped_when_the_last_agent_and_the_plant_have() -> None:
    entries = recorded(
        (1, "r1/command", DAMPED),  # before anybody pressed
        (12, "r1/command", HELD),
        (13, EVENT.name, Event.of(5, codes.LIES, "r1", "")),
        (14, "r2/command", DAMPED),
        (17, EVENT.name, STOPPED),
        (15, "r1/status", status("stand")),
        (18, "r1/command", DAMPED),
        (30, "r2/command", DAMPED),
    )
    press = [StopPress("page", 10 * MS + 7)]
    assert find_stops(entries, TIMES, press, ROBOTS, frozenset()) == [pytest.approx(8.0)]
    for gone in (3, 4, 6):
        some = [entry for n, entry in enumerate(entries[:-1]) if n != gone]
        assert find_stops(some, TIMES, press, ROBOTS, frozenset()) == [None]


def test_what_comes_after_the_last_that_was_heard_of_the_clock_has_no_time() -> None:
    entries = recorded((11, EVENT.name, STOPPED), (120, "r1/command", DAMPED))
    press = [StopPress("page", 10 * MS)]
    assert find_stops(entries, TIMES, press, ("r1",), frozenset()) == [None]


def test_each_press_has_the_time_until_the_next_one() -> None:
    entries = recorded(
        (11, EVENT.name, STOPPED),
        (12, "r1/command", DAMPED),
        (14, "r2/command", DAMPED),
        (21, "r1/status", status("walk")),
        (22, "r1/status", status("stopping")),
        (24, "r2/status", status("stand")),
        (27, "r1/status", status("stand")),
        (41, EVENT.name, STOPPED),
        (42, "r1/command", DAMPED),
    )
    ways = (("page", 10), ("silence", 20), ("estop", 40))
    presses = [StopPress(way, at * MS + 7) for way, at in ways]
    found = find_stops(entries, TIMES, presses, ROBOTS, frozenset({"silence"}))
    assert found == [pytest.approx(4.0), pytest.approx(7.0), None]
    assert find_stops([], TIMES, presses, ROBOTS, frozenset()) == [None] * 3


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
