"""Robots that hang: held in place whatever their legs do, and let down onto them."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.shared.config.load import load
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.native.hanger import HUNG_HEIGHT, Hanger
from quadriga.sim_server.world.world import World

ZERO = np.zeros(12)


def build(kind: str, robots: int = 1, spawn: str = "lying") -> tuple[World, Hanger]:
    config = load(
        overrides={"team.robots": robots, "team.robot": kind, "world.spawn": spawn, "world.seed": 3}
    )
    world = World(config)
    return world, Hanger(world)


def command(q: Array, kp: float = 60.0, kd: float = 2.0) -> Command:
    return Command(0, 0, ZERO, q, ZERO, np.full(12, kp), np.full(12, kd))


def heights(world: World) -> Array:
    return world.truth().base_pos[:, 2]


@pytest.mark.parametrize("kind", ["a1", "go1", "go2"])
def test_a_robot_that_hangs_stays_level_and_in_place_while_its_legs_move(kind: str) -> None:
    world, hanger = build(kind, robots=2)
    hanger.spawn_hung()
    place = world.truth().base_pos.copy()
    np.testing.assert_allclose(place[:, 2], HUNG_HEIGHT, atol=0.01)
    stand = load(overrides={"team.robot": kind}).robot.q_stand
    for tick in range(1000):
        swing = 0.3 * np.sin(2 * np.pi * 1.5 * 1e-3 * tick)
        hanger.hold()
        world.step({name: command(stand + swing) for name in world.names})
        truth = world.truth()
        assert np.abs(truth.base_pos - place).max() < 0.02
        assert np.abs(truth.base_quat_wxyz[:, 1:3]).max() < 0.05  # halves of roll and pitch
    assert not truth.grf.any(), "its feet are off the ground"
    assert hanger.hung == world.names


def test_a_robot_at_rest_hangs_at_rest() -> None:
    world, hanger = build("a1")
    hanger.spawn_hung()
    for _ in range(500):
        hanger.hold()
        world.step({})
    truth = world.truth()
    assert np.abs(truth.base_vel).max() < 0.02
    force = world.states()["r1"].imu_accel
    np.testing.assert_allclose(np.linalg.norm(force), 9.81, atol=0.5)


def test_one_robot_is_pulled_up_and_the_other_stays() -> None:
    world, hanger = build("a1", robots=2)
    before = heights(world)
    world.team.model.eq_active0[:] = 0
    world.physics.eq_active[:] = 0  # no yoke between them
    hanger.pull_up("r2")
    for _ in range(4000):
        hanger.hold()
        world.step({})
    after = heights(world)
    assert after[1] == pytest.approx(HUNG_HEIGHT, abs=0.02)
    assert after[0] == pytest.approx(before[0], abs=0.05)
    assert hanger.hung == ("r2",)


def test_a_robot_that_is_let_down_stands_by_itself_and_is_let_go_of() -> None:
    world, hanger = build("go2")
    hanger.spawn_hung()
    config = load(overrides={"team.robot": "go2"})
    stand = command(config.robot.q_stand, kp=80.0, kd=4.0)
    hanger.let_down("r1")
    ticks = 0
    while hanger.hung and ticks < 4000:
        hanger.hold()
        world.step({"r1": stand})
        ticks += 1
    assert 500 < ticks < 4000
    assert not world.physics.xfrc_applied.any()
    for _ in range(500):
        hanger.hold()
        world.step({"r1": stand})
    truth = world.truth()
    assert truth.base_pos[0, 2] == pytest.approx(config.robot.stand_height, abs=0.05)
    assert abs(truth.base_vel[0, 2]) < 0.02


def test_a_rope_never_pushes_down() -> None:
    world, hanger = build("a1", spawn="standing")
    hanger.let_down("r1")  # it does not hang: nothing happens
    hanger.hold()
    assert not world.physics.xfrc_applied.any()
    hanger.pull_up("r1")
    hanger.hold()
    world.physics.qpos[2] += 0.2  # the robot is above the rope's end
    hanger.hold()
    assert world.physics.xfrc_applied[world.team.trunks[0], 2] == 0.0
