"""What is told of robots: what lasts, when it began, and who stands, lies or falls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quadriga.shared.config.load import load
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.native.news import (
    DAMPED,
    DRIVEN,
    LASTS_MS,
    LOST,
    OFF,
    LostTime,
    MotorNews,
    News,
    PostureNews,
    describe_motors,
)
from quadriga.sim_server.world.world import World

ZERO, ONES = np.zeros(12), np.ones(12)


def command(tau: Array = ZERO, kp: Array = ZERO, kd: Array = ZERO) -> Command:
    return Command(0, 0, tau, ZERO, ZERO, kp, kd)


def test_motors_are_damped_if_they_only_brake() -> None:
    rates = np.linspace(-10.0, 10.0, 12)
    assert describe_motors(None, rates) == OFF
    assert describe_motors(command(), rates) == OFF
    assert describe_motors(command(kd=3.0 * ONES), rates) == DAMPED
    # A bridge that damps a robot takes some torque off: less brake, but still a brake.
    for share in (0.5, 1.0):
        assert describe_motors(command(tau=share * 3.0 * rates, kd=3.0 * ONES), rates) == DAMPED


def test_torque_or_stiffness_drives_them() -> None:
    still = ZERO
    assert describe_motors(command(tau=5.0 * ONES), still) == DRIVEN
    assert describe_motors(command(tau=8.0 * ONES, kd=3.0 * ONES), still) == DRIVEN
    one = np.eye(12)[3]
    assert describe_motors(command(kp=80.0 * one, kd=ONES), still) == DRIVEN
    assert describe_motors(command(tau=0.1 * one), still) == DRIVEN
    assert describe_motors(command(tau=5.0 * one, kd=ONES - one), still) == DRIVEN
    assert describe_motors(command(kd=ONES - one), still) == DAMPED


def test_a_slow_computer_is_told_of_once_a_second() -> None:
    news = LostTime()
    lost = {1500: 0.02, 2999: 0.05, 4000: 0.06}
    told, now_lost = list[str](), 0.0
    for now in range(1, 6001):
        now_lost = lost.get(now, now_lost)
        told += [line] if (line := news.look(now, now_lost)) else []
    assert told == [f"2000 ms: 20 ms {LOST}", f"3000 ms: 30 ms {LOST}", f"4000 ms: 10 ms {LOST}"]


def test_what_lasts_is_told_with_the_tick_at_which_it_began() -> None:
    news, told = MotorNews(), list[str]()
    doings = [OFF] * 30 + [DRIVEN] * 100 + [DAMPED, DRIVEN] * 50 + [DAMPED] * 100
    for now, doing in enumerate(doings):
        if line := news.look(now, doing):
            told.append(line.format(name="r1"))
            assert now == int(line.split()[0]) + LASTS_MS
    assert told == ["30 ms: r1 motors driven", "230 ms: r1 motors damped"]
    assert news.last() == ""
    news.look(330, OFF)
    assert news.last().format(name="r1") == "330 ms: r1 motors off"


def pose(z: float, roll: float = 0.0) -> Array:
    return np.array([0.0, 0.0, z, math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0])


@pytest.fixture
def posture() -> PostureNews:
    config = load(overrides={"team.robots": 1})
    world = World(config)
    return PostureNews(0.26, world.team.terrain, config.robot.feet_under_hips)


def stand(posture: PostureNews) -> None:
    told = [line for now in range(1000) if (line := posture.look(now, pose(0.26), 0.0))]
    assert told == ["0 ms: {name} stands"]


def test_that_it_lies_at_first_is_no_news(posture: PostureNews) -> None:
    for now in range(1000):
        assert posture.look(now, pose(0.08), 0.0) == ""
        assert posture.look(now, pose(0.08, roll=3.0), 2.0) == ""


def test_a_robot_that_tips_over_or_drops_has_fallen(posture: PostureNews) -> None:
    stand(posture)
    assert posture.look(1000, pose(0.26, roll=0.9), 0.0) == ""
    line = posture.look(1001, pose(0.2, roll=1.1), 0.4)
    assert line == "1001 ms: fall {name} tilt 1.10 rad, height 0.200 m, 0.40 m/s down"
    assert posture.look(1002, pose(0.1, roll=1.1), 0.4) == "", "once"
    stand(posture)
    assert posture.look(1000, pose(0.11), 1.2).startswith("1000 ms: fall {name} tilt 0.00 rad")


def test_a_robot_that_comes_down_slowly_has_lain_down(posture: PostureNews) -> None:
    stand(posture)
    assert posture.look(1000, pose(0.13), 0.1) == ""
    assert posture.look(1001, pose(0.11), 0.1) == "1001 ms: {name} lies, 0.10 m/s down"


def test_a_state_that_is_no_number_is_a_fall(posture: PostureNews) -> None:
    stand(posture)
    assert "fall" in posture.look(1000, np.full(7, np.nan), 0.0)


def test_the_news_of_a_world_name_its_robots() -> None:
    config = load(overrides={"team.robots": 2})
    world = World(config)
    news, told = News(world, config.robot.stand_height, config.robot.feet_under_hips), list[str]()
    q = config.robot.q_stand
    commands: dict[str, Command | None] = {
        "r1": Command(0, 0, ZERO, q, ZERO, 80.0 * ONES, 4.0 * ONES),
        "r2": None,
    }
    for _ in range(1500):
        told += news.of_motors(commands)
        world.step({name: row for name, row in commands.items() if row is not None})
        told += news.of_postures(hung=())
    assert told[0] == "0 ms: r1 motors driven"
    assert "0 ms: r1 stands" in told or "10 ms: r1 stands" in told
    assert any("r2 lies, " in line or "fall r2" in line for line in told)
    assert not any("fall r1" in line for line in told)
    commands["r1"] = None
    news.of_motors(commands)
    assert news.rest() == ["1500 ms: r1 motors off"]
