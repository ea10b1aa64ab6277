"""A late command is held, then damped; holding carries a standing robot."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from quadriga.plant.commands import CommandBox
from quadriga.plant.late import (
    DAMP,
    FRESH,
    HOLD,
    MOST_HELD_MS,
    PROMPT_TICKS,
    SURE_TICKS,
    Lateness,
    grade,
    hold_joints,
)
from quadriga.plant.realtime import _Motors
from quadriga.plant.server import PlantServer
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.robots.a1 import A1
from quadriga.sim_server.world.world import World


@pytest.mark.parametrize(
    ("age", "expected"), [(0, FRESH), (20, FRESH), (21, HOLD), (200, HOLD), (201, DAMP)]
)
def test_grades_by_age(age: int, expected: str) -> None:
    assert grade(age, Config().world) == expected


def test_an_age_that_dithers_about_the_limit_does_not_change_the_grade_with_it() -> None:
    lateness = Lateness(Config().world)
    ages = [19, 20, 20, 21, *(20 + k % 3 - 1 for k in range(300))]
    grades = [lateness.grade(age) for age in ages]
    assert grades == [FRESH] * 3 + [HOLD] * 301


def test_who_was_late_is_followed_again_once_its_commands_are_prompt() -> None:
    lateness = Lateness(Config().world)
    assert [lateness.grade(age) for age in (18, 21, 200)] == [FRESH, HOLD, HOLD]
    assert {lateness.grade(10) for _ in range(PROMPT_TICKS - 1)} == {HOLD}
    assert lateness.grade(11) == HOLD, "so it begins to count anew"
    assert {lateness.grade(10) for _ in range(PROMPT_TICKS - 1)} == {HOLD}
    assert lateness.late_ms == 2 + 2 * (PROMPT_TICKS - 1) + 1
    assert {lateness.grade(age) for age in (10, 20, 1, 19)} == {FRESH}
    assert lateness.late_ms == 0


def test_commands_that_are_always_late_are_lost() -> None:
    lateness = Lateness(Config().world)
    grades = [lateness.grade(22) for _ in range(MOST_HELD_MS + 10)]
    assert grades == [HOLD] * MOST_HELD_MS + [DAMP] * 10


def test_whose_commands_were_lost_is_led_down_until_they_are_surely_back() -> None:
    """A link that loses packets lets some commands through between two silences."""
    lateness = Lateness(Config().world)
    silence_and_burst = [*range(202), *([1] * 40)]
    grades = [lateness.grade(age) for age in 3 * silence_and_burst]
    assert grades.index(DAMP) == 201
    assert set(grades[201:]) == {DAMP}
    assert {lateness.grade(1) for _ in range(SURE_TICKS - 41)} == {DAMP}
    assert lateness.grade(1) == FRESH


def test_holding_keeps_a_standing_robot_up_and_damping_does_not() -> None:
    config = replace(Config(), team=TeamConfig(robots=1))
    held, limp = World(config), World(config)
    command = {"r1": hold_joints(held.states()["r1"])}
    for _ in range(500):
        held.step(command)
        limp.step({})
    assert held.truth().base_pos[0, 2] == pytest.approx(0.26, abs=0.03)
    assert limp.truth().base_pos[0, 2] < 0.2
    assert not held.fallen()


def test_a_robot_that_was_damped_is_not_held_by_a_command_that_is_late() -> None:
    """Silent for 400 ms it is held, then damped and sinks; then a command comes, 100 ms old."""
    world = World(replace(Config(), team=TeamConfig(robots=1)))
    box = CommandBox("team", world.names, A1)
    server = SimpleNamespace(plant=world, commands=box, config=Config(), late_ms={})
    motors = _Motors(cast(PlantServer, server))
    box.latest["r1"] = hold_joints(world.states()["r1"])
    poses = {}
    while world.tick < 500:
        if world.tick == 450:
            box.latest["r1"] = replace(box.latest["r1"], tick=350)
        commands = motors.commands()
        poses[world.tick] = commands["r1"].q_des if commands else None
        world.step(commands)
    assert poses[100] is not None
    assert poses[200] is not None
    np.testing.assert_array_equal(poses[100], poses[200])
    assert poses[300] is poses[499] is None
    assert server.late_ms == {"r1": 500 - 21}, "held from the tick on at which it was 21 ms old"
