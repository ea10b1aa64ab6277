"""A late command is held, then damped; holding carries a standing robot."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from quadriga.plant.commands import CommandBox
from quadriga.plant.late import DAMP, FRESH, HOLD, PROMPT_TICKS, Lateness, grade, hold_joints
from quadriga.plant.realtime import _Motors
from quadriga.plant.server import PlantServer
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.robot.a1 import A1
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
    assert [lateness.grade(age) for age in (18, 201, 200, 21)] == [FRESH, DAMP, HOLD, HOLD]
    assert {lateness.grade(10) for _ in range(PROMPT_TICKS - 1)} == {HOLD}
    assert lateness.grade(11) == HOLD, "so it begins to count anew"
    assert {lateness.grade(10) for _ in range(PROMPT_TICKS - 1)} == {HOLD}
    assert {lateness.grade(age) for age in (10, 20, 1, 19)} == {FRESH}


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


def test_a_robot_that_was_damped_is_not_drawn_back_to_where_it_was_held() -> None:
    """Silent for 400 ms it is held, then damped and sinks; then a command comes, 100 ms old."""
    world = World(replace(Config(), team=TeamConfig(robots=1)))
    box = CommandBox("team", world.names, A1)
    motors = _Motors(cast(PlantServer, SimpleNamespace(plant=world, commands=box, config=Config())))
    box.latest["r1"] = hold_joints(world.states()["r1"])
    poses = {}
    while world.tick < 500:
        if world.tick == 450:
            box.latest["r1"] = replace(box.latest["r1"], tick=350)
        commands = motors.commands()
        poses[world.tick] = commands["r1"].q_des if commands else None
        world.step(commands)
    assert poses[300] is None
    assert poses[100] is not None
    assert poses[499] is not None
    np.testing.assert_array_equal(poses[100], poses[200])
    assert np.abs(poses[499] - poses[100]).max() > 0.1
