"""A robot whose commands are lost is led down slowly, and that is no fall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from quadriga.identification.rollout import Rollout
from quadriga.plant.lost import LostCommands
from quadriga.shared.config.load import load
from quadriga.shared.messages import Command
from quadriga.sim_server.world.world import World
from quadriga.team.operator import references_of
from tests.sim_server.standing import STAND, configured, stand

DOWN_MS = 2600  # the way down, and the sinking after it


def lose(world: World, lost: LostCommands, ticks: int, commands: Mapping[str, Command]) -> float:
    """Let a world go on without some commands; the greatest tilt of its last robot, rad."""
    worst = 0.0
    for _ in range(ticks):
        world.expect_down(lost.lowered)
        world.step(lost.fill(world.tick, world.names, commands, world.states))
        _, x, y, _ = world.truth().base_quat_wxyz[-1]
        worst = max(worst, float(np.arccos(1.0 - 2.0 * (x * x + y * y))))
    return worst


def test_a_standing_robot_is_led_down_and_then_damped() -> None:
    config = configured(2, yokes="none")
    world, lost = World(config), LostCommands(config)
    stand(world, 300)
    speeds, followed = list[float](), list[bool]()
    for _ in range(DOWN_MS):
        commands = lost.fill(world.tick, world.names, {"r1": STAND}, world.states)
        followed.append("r2" in commands)
        world.expect_down(lost.lowered)
        assert not [event for event in world.step(commands) if event.kind == "fall"]
        speeds.append(float(world.truth().base_vel[1, 2]))
    assert lost.lowered == {"r2"}
    assert all(followed[:2400])
    assert not any(followed[2550:])
    heights = world.truth().base_pos[:, 2]
    assert heights[0] == pytest.approx(0.26, abs=0.02)
    assert heights[1] < 0.1
    assert min(speeds) > -0.5, "damped joints let it fall at 1 m/s"
    assert not world.fallen()


@pytest.mark.parametrize("terrain", ["flat", "stairs"])  # of which the top is far above the robot
def test_who_has_commands_again_follows_them_and_may_fall(terrain: str) -> None:
    config = configured(1, terrain=terrain)
    world, lost = World(config), LostCommands(config)
    stand(world, 100)
    lose(world, lost, 200, {})
    assert lost.lowered == {"r1"}
    assert lost.fill(world.tick, world.names, {"r1": STAND}, world.states) == {"r1": STAND}
    assert not lost.lowered
    world.expect_down(())
    stand(world, 500)
    assert world.truth().base_pos[0, 2] > 0.24
    for _ in range(1000):
        world.step({})
    assert world.fallen() == ("r1",)


BRIDGED = {"team.plant": "robots", "team.plant_per_robot": True, "world.mode": "realtime"}


@pytest.mark.parametrize("given", [{"world.lost_command": "damp"}, BRIDGED], ids=["damp", "robots"])
def test_only_simulated_robots_and_only_if_configured(given: dict[str, str]) -> None:
    lost = LostCommands(load(None, given))

    def states() -> dict[str, object]:
        raise AssertionError("nobody looks")

    assert lost.fill(0, ("r1",), {}, states) == {}  # type: ignore[arg-type]
    assert not lost.lowered


@pytest.mark.parametrize("at", range(1500, 1900, 50))
def test_out_of_a_trot_it_comes_down_upright_at_any_phase(at: int) -> None:
    config = load(None, {"team.robots": 1, "planner.kind": "none"})
    config = replace(config, world=replace(config.world, duration=10.0))
    rollout, lost = Rollout(config, None, references_of(config)), LostCommands(config)
    for _ in rollout.ticks(at):
        pass
    assert lose(rollout.world, lost, DOWN_MS, {}) < 0.5  # rad
    assert not rollout.world.fallen()
