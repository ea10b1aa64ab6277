"""Commands at the world's door: only a valid one, of the right time, of a known robot gets in."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.plant.commands import CommandBox, command_limits
from quadriga.shared.codec import MAX_TICK
from quadriga.shared.config.sections import TeamConfig
from quadriga.shared.messages import Command
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.spec import RobotSpec
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import configured


def command(tick: int, tau: float = 0.0) -> Command:
    return Command.from_row(tick, tick * 1_000_000, np.full(60, tau))


def command_of(**values: float) -> Command:
    """A command of tick 5, zero but for the last joint's numbers."""
    row = np.zeros(60)
    for name, value in values.items():
        row[Command.CUTS[name].stop - 1] = value
    return Command.from_row(5, 5_000_000, row)


@pytest.fixture
def box() -> CommandBox:
    return CommandBox(A1)


def test_the_command_of_the_tick_is_taken_once(box: CommandBox) -> None:
    assert box.take("r1", command(5, 1.0), tick=5, oldest=5)
    assert box.latest["r1"].tau[0] == 1.0
    assert (box.tick_of("r1"), box.tick_of("r2")) == (5, -1)
    assert not box.take("r1", command(5, 1.0), tick=5, oldest=5)
    assert (box.invalid["r1"], box.errors, list(box.latest)) == (0, {}, ["r1"])


@pytest.mark.parametrize("wrong", [4, 6, MAX_TICK - 1])
def test_lock_step_discards_other_ticks(box: CommandBox, wrong: int) -> None:
    assert not box.take("r1", command(wrong), tick=5, oldest=5)
    assert (box.invalid["r1"], box.latest) == (0, {})


def test_two_commands_of_one_tick_are_told(box: CommandBox) -> None:
    """Nobody can know which of them is the robot's own agent's."""
    assert box.take("r1", command(5, 1.0), tick=5, oldest=5)
    for tick in (5, 6):  # in lock-step, too, once the world has gone on
        assert not box.take("r1", command(5, 1.5), tick=tick, oldest=tick)
    assert box.latest["r1"].tau[0] == 1.0
    assert box.invalid["r1"] == 2
    assert "two of tick 5 for r1" in box.errors["r1"]


def test_real_time_takes_older_ones_but_never_goes_back(box: CommandBox) -> None:
    assert box.take("r1", command(7), tick=9, oldest=0)
    assert not box.take("r1", command(6), tick=9, oldest=0)
    assert box.tick_of("r1") == 7


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        (command(5, float("nan")), "command.tau: got nan, expected -67 … 67"),
        (command(5, float("inf")), "command.tau: got inf, expected -67 … 67"),
        (command_of(kp=1e300), "command.kp: got "),
        (command_of(kd=1e300), "command.kd: got "),
        (command_of(q_des=-1e300, kp=80.0), "command.q_des: got "),
        (command_of(v_des=1e300, kd=3.0), "command.v_des: got "),
        (command_of(tau=70.0), "command.tau: got "),
        (command_of(kp=501.0), "command.kp: got "),
        (command_of(kp=-1.0), "command.kp: got "),
        (command_of(kd=-0.1), "command.kd: got "),
        (command_of(q_des=4.0), "command.q_des: got "),
        (command_of(v_des=-43.0), "command.v_des: got "),
    ],
)
def test_what_is_no_command_that_can_be_meant_is_dropped_and_counted(
    box: CommandBox, wrong: Command, error: str
) -> None:
    assert not box.take("r1", wrong, tick=5, oldest=5)
    assert box.invalid["r1"] == 1
    assert box.errors["r1"].startswith(error)
    assert box.latest == {}
    assert box.take("r1", command(5, 1.0), tick=5, oldest=5), "the robot's own still counts"


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=list(ROBOTS))
def test_what_agents_and_plants_send_is_within_the_limits(robot: RobotSpec) -> None:
    least, most = command_limits(robot)
    for name, array in (
        ("tau", robot.torque_limit),
        ("tau", -robot.torque_limit),
        ("q_des", np.array(robot.lower)),
        ("q_des", np.array(robot.upper)),
        ("q_des", np.zeros(12)),  # of a command of torques alone
        ("v_des", np.tile(robot.speed, 4)),
    ):
        cut = Command.CUTS[name]
        assert (least[cut] < array).all()
        assert (array < most[cut]).all()


@pytest.mark.parametrize("kind", ROBOTS)
def test_no_command_that_is_taken_makes_the_world_lose_its_numbers(kind: str) -> None:
    """The worst of them, one after the other: all at their limits, with the signs of a tick."""
    config = replace(configured(), team=TeamConfig(robots=1, robot=kind))
    random = np.random.default_rng(3)
    world = World(config)
    box, (least, most) = CommandBox(config.robot), command_limits(config.robot)
    for tick in range(400):
        signs = random.random(60) < 0.5 if tick % 2 else np.full(60, tick % 4 == 0)
        worst = Command.from_row(tick, 0, np.where(signs, least, most))
        assert box.take("r1", worst, tick=tick, oldest=tick)
        world.step(box.latest)
        state = world.states()["r1"]
        assert np.isfinite(state.row).all(), tick
    truth: Any = world.truth()
    assert np.isfinite(truth.base_pos).all()
    assert np.isfinite(world.physics.qacc).all()
    assert np.abs(world.motors.torque).max() <= max(config.robot.torque)


def test_why_a_robot_is_silent_is_known_until_it_is_not(box: CommandBox) -> None:
    assert "r1" not in box.refused
    box.take("r1", command(5, float("nan")), tick=5, oldest=5)
    assert "command.tau: got nan" in box.refused["r1"]
    for wrong in (4, 6):
        box.take("r1", command(wrong), tick=5, oldest=5)
        assert box.refused["r1"] == f"command.tick: got {wrong}, expected 5"
    box.take("r1", command(3), tick=8, oldest=0)
    assert box.latest["r1"].tick == 3, "in real time"
    assert "r1" not in box.refused
    box.take("r1", command(9), tick=8, oldest=0)
    assert box.refused["r1"] == "command.tick: got 9, expected 4 … 8"
    assert box.errors.keys() == {"r1"}, "a tick alone is nothing that nobody sends"
