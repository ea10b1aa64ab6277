"""A late command is held, then damped; holding carries a standing robot."""

from __future__ import annotations

from dataclasses import replace

import pytest

from shared.config import Config, TeamConfig
from sim_server.late import DAMP, FRESH, HOLD, grade, hold
from sim_server.world import World


@pytest.mark.parametrize(
    ("age", "expected"), [(0, FRESH), (20, FRESH), (21, HOLD), (200, HOLD), (201, DAMP)]
)
def test_grades_by_age(age: int, expected: str) -> None:
    assert grade(age, Config().world) == expected


def test_holding_keeps_a_standing_robot_up_and_damping_does_not() -> None:
    config = replace(Config(), team=TeamConfig(robots=1))
    held, limp = World(config), World(config)
    command = {"r1": hold(held.states()["r1"])}
    for _ in range(500):
        held.step(command)
        limp.step({})
    assert held.truth().base_pos[0, 2] == pytest.approx(0.26, abs=0.03)
    assert limp.truth().base_pos[0, 2] < 0.2
    assert not held.fallen()
