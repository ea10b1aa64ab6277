"""Messages of a team become a reading: rates, costs, ages, modes, late commands."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.shared.codec import encode
from quadriga.shared.codes import FALL
from quadriga.shared.config.load import load
from quadriga.shared.messages import Clock, Event, Message, Status
from quadriga.shared.topics import CLOCK_MS
from quadriga.status.gather import StatusFold
from quadriga.status.record import Costs

CONFIG = load(None, {"team.robots": 2, "world.mode": "realtime"})
SECOND = 1_000_000_000


def status(tick: int, mode: str = "walk", **fields: object) -> Status:
    given = {
        "reason": "",
        "ages_ms": {"reference": 40.0, "plan.r2": 40.0},
        "counters": {},
        "planner_ms": np.zeros(0),
        "tick_us": np.array([100.0, 300.0]),
    } | fields
    return Status(tick, tick * 1_000_000, mode, estimator="kalman", **given)  # type: ignore[arg-type]


def plant(tick: int, due: int, late: int) -> Status:
    return status(tick, "realtime", counters={"r1.due": due, "r1.late": late, "ticks": tick})


def add(fold: StatusFold, key: str, message: Message, at_ns: int) -> None:
    fold.add(f"team/{key}", encode(message), message.tick, at_ns)


def clock(tick: int) -> Clock:
    return Clock(tick, tick * 1_000_000)


def test_nothing_is_known_of_a_team_that_says_nothing() -> None:
    reading = StatusFold(CONFIG).look(0)
    assert (reading.tick, reading.pace, reading.accounts, reading.topics) == (-1, None, {}, ())


def test_pace_and_rates_are_those_since_the_last_look() -> None:
    fold = StatusFold(CONFIG)
    for k in range(11):
        add(fold, "clock", clock(CLOCK_MS * k), SECOND + k * SECOND // 100)
    fold.look(SECOND)
    for k in range(11, 21):  # half as fast, and the last but one is lost
        if k != 19:
            add(fold, "clock", clock(CLOCK_MS * k), SECOND + k * SECOND // 50)
    reading = fold.look(2 * SECOND)
    assert reading.tick == 1000
    assert reading.pace == pytest.approx(500 / 300)  # 0.5 s of the world since 1.1 s: until 1.4 s
    (of,) = reading.topics
    assert (of.key, of.messages, of.lost) == ("team/clock", 9, 1)
    assert of.per_world_s == pytest.approx(18.0)
    assert reading.lost == {"team/clock": 1}
    later = fold.look(3 * SECOND)
    assert (later.pace, later.lost, later.topics[0].lost) == (None, {}, 1)


def test_an_account_is_the_newest_status_with_all_costs_since_the_last_look() -> None:
    fold = StatusFold(CONFIG)
    add(fold, "r1/status", status(100, planner_ms=np.array([1.0])), SECOND)
    add(fold, "r1/status", status(200, "stand", reason="peer-lost:r2"), 2 * SECOND)
    account = fold.look(2 * SECOND + SECOND // 2).accounts["r1"]
    assert (account.mode, account.reason, account.age_ms) == ("stand", "peer-lost:r2", 500.0)
    assert account.planner_ms == Costs(1.0, 1.0, 1.0)
    assert account.tick_us == Costs(200.0, 300.0, 300.0)
    assert account.ages_ms == {"reference": 40.0, "plan.r2": 40.0}
    later = fold.look(4 * SECOND).accounts["r1"]
    assert (later.mode, later.age_ms, later.tick_us) == ("stand", 2000.0, None)


def test_late_commands_are_those_between_two_reports() -> None:
    fold = StatusFold(CONFIG)
    add(fold, "sim/status", plant(1000, 1000, 100), SECOND)
    assert fold.look(SECOND).late == {"r1": 0.1}
    add(fold, "sim/status", plant(2000, 2000, 600), 2 * SECOND)
    assert fold.look(2 * SECOND).late == {"r1": 0.5}
    assert fold.look(3 * SECOND).late == {"r1": 0.5}  # the newest there is


def test_events_are_lines_and_the_last_few_stay() -> None:
    fold = StatusFold(CONFIG)
    for k in range(9):
        add(fold, "sim/event", Event.of(k, FALL, "r1", "tilt \x1b[2J"), SECOND)
    events = fold.look(SECOND).events
    assert len(events) == 5
    assert events[-1] == "8 ms: fall r1 tilt \N{REPLACEMENT CHARACTER}[2J"


def test_what_is_no_message_is_counted_and_not_believed() -> None:
    fold = StatusFold(CONFIG)
    fold.add("team/r1/status", b"\xff", -1, SECOND)
    fold.add("team/what/ever", b"", -1, SECOND)
    reading = fold.look(SECOND)
    assert reading.accounts == {}
    assert [of.key for of in reading.topics] == ["team/r1/status", "team/what/ever"]
