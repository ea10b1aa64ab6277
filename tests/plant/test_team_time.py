"""Who drives time when each robot has a plant of its own, and when a plant must end."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.plant.team_time import FollowerTime, LeadTime, TeamTime, team_time
from quadriga.shared import codes
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Clock, Event, State
from quadriga.shared.topics import CLOCK, EVENT, STATE


@pytest.fixture
def config() -> Config:
    keys = {"team.robots": 3, "team.yokes": "none", "team.plant_per_robot": True}
    return load(None, {**keys, "world.mode": "realtime"})


def state(tick: int) -> bytes:
    return encode(State.from_row(tick, tick * 10**6, np.zeros(50)))


def clock(tick: int) -> bytes:
    return encode(Clock(tick, tick * 10**6))


def event(code: str, robot: str = "", tick: int = 0) -> bytes:
    return encode(Event.of(tick, code, robot, ""))


def test_the_first_robot_s_plant_drives_time_for_the_others(config: Config) -> None:
    assert type(team_time(config, "")) is TeamTime
    assert type(team_time(config, "r1")) is LeadTime
    assert type(team_time(config, "r3")) is FollowerTime


def test_the_walk_ends_when_another_plant_has_lost_its_robots_commands(config: Config) -> None:
    time = LeadTime(config, "r1")
    time.take(EVENT.key("team"), event(codes.COMMAND_LOST, "stranger"), 7)
    assert time.end is None
    time.take(EVENT.key("team"), event(codes.COMMAND_LOST, "r2"), 7)
    assert time.end is not None
    assert time.end.code == codes.COMMAND_LOST


def test_a_fall_in_another_plant_is_heard(config: Config) -> None:
    time = LeadTime(config, "r1")
    time.take(EVENT.key("team"), event(codes.FALL, "r3", 700), 700)
    time.take(EVENT.key("team"), event(codes.FALL, "stranger", 700), 700)
    assert [(fall.robot, fall.tick) for fall in time.falls] == [("r3", 700)]


def test_followers_leave_by_the_same_event_as_all_others(config: Config) -> None:
    time = FollowerTime(config)
    time.take(EVENT.key("team"), event(codes.FALL, "r1"), 5)
    assert time.end is None
    time.take(EVENT.key("team"), event(codes.TIME_OVER), 5)
    assert time.end is not None
    assert time.end.code == codes.TIME_OVER


@pytest.mark.parametrize("robot", ["r1", "r2"])
def test_a_plant_is_silent_whose_newest_message_is_too_old(robot: str) -> None:
    keys = {"team.robots": 2, "team.yokes": "none", "team.plant_per_robot": True}
    time = team_time(load(None, {**keys, "world.mode": "realtime"}), robot)
    other, topic, said = (
        ("plant_r2", STATE.key("team", "r2"), state)
        if robot == "r1"
        else ("plant_r1", CLOCK.key("team"), clock)
    )
    time.take(topic, said(700), 690)
    time.take(topic, said(9999), 700)
    assert not time.behind(700), "it may be ahead, of one that was late, but not by seconds"
    assert time.behind(701) == {other}


def test_who_drives_time_ends_when_another_plant_is_gone(config: Config) -> None:
    lead = LeadTime(config, "r1")
    lead.look({"plant_r2", "plant_r3", "r1"})
    assert lead.end is None
    lead.look({"plant_r3", "r1"})
    assert lead.end == (codes.PLANT_GONE, "plant_r2 gone")


def test_the_last_messages_of_who_drives_time_may_come_after_it_left(config: Config) -> None:
    for heard, code in ((True, codes.TIME_OVER), (False, codes.PLANT_GONE)):
        time = FollowerTime(config)
        for _ in range(9):
            time.look({"r1", "r2"})
        assert time.end is None
        if heard:
            time.take(EVENT.key("team"), event(codes.TIME_OVER), 5)
        time.look({"r1", "r2"})
        assert time.end is not None
        assert time.end.code == code
