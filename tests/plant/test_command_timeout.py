"""In real time a late command is replaced by holding the joints; one that stays away is lost."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import pytest

from quadriga.plant.commands import MOST_HELD_MS, PROMPT_TICKS, CommandTimeout, hold_joints
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.messages import State
from quadriga.sim_server.world.world import World
from tests.a1 import standing
from tests.sim_server.standing import STAND

WORLD = Config().world  # holds after 20 ms, has lost after 200 ms
FIRST = 300  # ms, until which no first command is missed


def measured(state: State) -> dict[str, State]:
    return {"r1": state}


def follow(ages: Iterable[int | None]) -> list[str]:
    """What the motors do at each tick with a command of this age, None: before the first."""
    timeout, done = CommandTimeout(WORLD, FIRST), []
    for tick, age in enumerate(ages):
        command = None if age is None else replace(STAND, tick=tick - age)
        chosen = timeout.choose(command, tick, partial(measured, standing(tick)), "r1")
        lost = bool(timeout.describe_loss(command, tick))
        assert (chosen is command) == (timeout.held is None)
        done.append("lost" if lost else "follow" if chosen is command else "hold")
    return done


@pytest.mark.parametrize(
    ("age", "does"), [(0, "follow"), (20, "follow"), (21, "hold"), (200, "hold"), (201, "lost")]
)
def test_what_motors_do_goes_by_the_age_of_the_command(age: int, does: str) -> None:
    assert follow([age]) == [does]


PROMPT = [10] * (PROMPT_TICKS - 1)


@pytest.mark.parametrize(
    ("ages", "does"),
    [
        # One that dithers about the limit does not have them change with it.
        ([19, 20, 20, 21, *(20 + k % 3 - 1 for k in range(300))], ["follow"] * 3 + ["hold"] * 301),
        # It is followed again once its commands are prompt; 11 is not, so it counts anew.
        (
            [18, 21, 200, *PROMPT, 11, *PROMPT, 10, 20, 1],
            ["follow", *["hold"] * (2 + 2 * len(PROMPT) + 1), *["follow"] * 3],
        ),
        ([22] * (MOST_HELD_MS + 1), ["hold"] * MOST_HELD_MS + ["lost"]),
        ([None] * (FIRST + 1), ["hold"] * FIRST + ["lost"]),  # for as long as the team stands
    ],
    ids=["dithers", "prompt again", "always late", "never came"],
)
def test_a_late_robot_is_held_until_it_is_prompt_or_lost(
    ages: list[int | None], does: list[str]
) -> None:
    assert follow(ages) == does


def test_the_joints_are_held_where_they_were_when_the_command_became_late() -> None:
    timeout, tick = CommandTimeout(WORLD, FIRST), 0
    early = replace(standing(0), q_joint=standing(0).q_joint + 0.1)
    for tick, state in enumerate((early, standing(1), standing(2))):
        held = timeout.choose(replace(STAND, tick=tick - 30), tick, partial(measured, state), "r1")
        assert held.q_des.tolist() == early.q_joint.tolist()


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
