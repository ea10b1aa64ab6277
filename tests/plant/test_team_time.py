"""Who drives time when each robot has a plant of its own, and when a plant must end."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.plant.team_time import TeamTime
from quadriga.shared import codes
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import Clock, Event, Ticks
from quadriga.shared.topics import CLOCK, EVENT, TICKS

KEYS = {"team.robots": 3, "team.yokes": "none", "team.plant_per_robot": True}
CONFIG = load(None, {**KEYS, "world.mode": "realtime"})
EVERYBODY = {"plant_r1", "plant_r2", "plant_r3", "r1"}


def ticks(tick: int) -> bytes:
    return encode(Ticks(tick, tick * 10**6, 0, (), np.zeros((0, 53)), np.zeros((0, 63))))


def clock(tick: int) -> bytes:
    return encode(Clock(tick, tick * 10**6))


def end_of(time: TeamTime) -> str:
    return "" if time.end is None else time.end.code


@pytest.mark.parametrize(
    ("robot", "code", "of", "ends"),
    [
        ("r1", codes.COMMAND_LOST, "r2", True),
        ("r1", codes.COMMAND_LOST, "stranger", False),
        ("r1", codes.TIME_OVER, "", False),
        ("r2", codes.TIME_OVER, "", True),
        ("r2", codes.FALL, "r1", False),
    ],
)
def test_which_events_end_a_plants_walk(robot: str, code: str, of: str, ends: bool) -> None:
    time = TeamTime(CONFIG, robot)
    time.take(EVENT.key("team"), encode(Event.of(7, code, of, "")), 7)
    time.take(EVENT.key("team"), b"no event", 7)
    assert end_of(time) == (code if ends else "")


def test_a_fall_in_another_plant_is_heard() -> None:
    time = TeamTime(CONFIG, "r1")
    for robot in ("r3", "stranger"):
        time.take(EVENT.key("team"), encode(Event.of(700, codes.FALL, robot, "")), 700)
    assert [(fall.robot, fall.tick) for fall in time.falls] == [("r3", 700)]


@pytest.mark.parametrize("robot", ["r1", "r2"])
def test_a_plant_is_silent_whose_newest_message_is_too_old(robot: str) -> None:
    heard = {TICKS.key("team", f"plant_{name}"): ticks for name in ("r2", "r3")}
    heard = heard if robot == "r1" else {CLOCK.key("team"): clock}
    time = TeamTime(CONFIG, robot)
    for key, said in heard.items():
        time.take(key, said(700), 690)
        time.take(key, said(9999), 700)  # it may be ahead, of one that was late, but not by seconds
    time.look(EVERYBODY, 1200)
    assert time.end is None
    time.look(EVERYBODY, 1201)
    silent = "plant_r2, plant_r3" if robot == "r1" else "plant_r1"
    assert time.end == (codes.PLANT_GONE, f"{silent} silent for 0.5 s")


@pytest.mark.parametrize("heard", [True, False])
def test_the_announced_end_may_come_after_who_drives_time_has_left(heard: bool) -> None:
    time = TeamTime(CONFIG, "r2")
    for _ in range(9):
        time.look(EVERYBODY - {"plant_r1"}, 0)
    assert time.end is None
    if heard:
        time.take(EVENT.key("team"), encode(Event.of(5, codes.TIME_OVER, "r1", "")), 5)
    time.look(EVERYBODY - {"plant_r1"}, 0)
    assert time.end == ((codes.TIME_OVER, "") if heard else (codes.PLANT_GONE, "plant_r1 gone"))


def test_who_drives_time_ends_at_once_without_another_plant() -> None:
    time = TeamTime(CONFIG, "r1")
    time.look(EVERYBODY - {"plant_r3"}, 0)
    assert time.end == (codes.PLANT_GONE, "plant_r3 gone")


def test_the_plant_of_all_robots_depends_on_nobody() -> None:
    time = TeamTime(CONFIG)
    time.look((), 10**6)
    assert (time.drives, time.alone, time.keys, time.end) == (True, True, frozenset(), None)
