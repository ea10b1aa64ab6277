"""A robot that has been dropped stands up from where it lies, and lies down again, in MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
import pytest

from quadriga.bridges.supervisor import BridgeMode, Request, Supervisor, SupervisorInputs, tilt_of
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.unitree.packets import SERVO
from quadriga.sim_server.emulator import command_of, report_of
from quadriga.sim_server.world.world import World
from tests.bridges.robots import holding


class Moment(NamedTuple):
    """One tick: height and vertical speed of the trunk, and its tilt."""

    height: float
    falling: float
    tilt: float


class Robot:
    """One simulated robot under its supervisor, without a network."""

    def __init__(self, kind: str) -> None:
        self.config = load(overrides={"team.robot": kind, "team.robots": 1})
        self.world = World(self.config)
        self._supervisor = Supervisor(self.config.robot, self.config.bridge, SERVO)
        self.state = self._supervisor.initial(0, armed=True)
        self._on = holding(self.config)
        self.torque = 0.0

    def drop(self, q: Array) -> None:
        """Let it fall, passive, from joint angles at which it touches nothing, and come to rest."""
        physics, model = self.world.physics, self.world.team.model
        physics.qpos[2], physics.qpos[7:] = 0.5, q
        physics.qvel[:] = 0.0
        mujoco.mj_forward(model, physics)
        legs = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom]]
        physics.qpos[2] -= min(physics.geom_xpos[geom][2] for geom in legs) - 0.05
        mujoco.mj_forward(model, physics)
        for _ in range(800):
            self.world.step({})

    def do(self, request: Request, end: BridgeMode) -> Iterator[Moment]:
        """Tick by tick, until the bridge is in the mode `end`, or has stopped."""
        for _ in range(15_000):
            tick = self.world.tick
            state, heat = self.world.states()["r1"], self.world.motors.heat[0]
            report = report_of(state, heat, self._on)
            inputs = SupervisorInputs(now=tick, report=report, report_age=0, request=request)
            self.state, supervised = self._supervisor.step(self.state, inputs)
            if self.state.mode in (end, BridgeMode.ESTOP):
                return
            command = command_of(supervised.targets)
            self.world.step({} if command is None else {"r1": command})
            share = np.abs(self.world.motors.torque[0]) / self.config.robot.torque_limit
            self.torque = max(self.torque, float(share.max()))
            qpos, qvel = self.world.physics.qpos, self.world.physics.qvel
            yield Moment(float(qpos[2]), -float(qvel[2]), tilt_of(qpos[3:7]))


@pytest.mark.parametrize(("kind", "seed"), [("a1", 104), ("go1", 101), ("go2", 103)])
def test_from_where_it_fell_it_stands_up_and_lies_down_gently(kind: str, seed: int) -> None:
    robot, spec = Robot(kind), ROBOTS[kind]
    lower, upper = np.array(spec.lower) + 0.03, np.array(spec.upper) - 0.03
    robot.drop(np.random.default_rng(seed).uniform(lower, upper))
    up = list(robot.do(Request.STAND, BridgeMode.STAND))
    assert robot.state.reason == ""
    assert robot.torque <= 1.0
    assert up[-1].height == pytest.approx(spec.stand_height, rel=0.1)
    assert up[-1].tilt < 0.1
    down = list(robot.do(Request.LIE, BridgeMode.PASSIVE))
    assert robot.state.reason == ""
    assert max(moment.falling for moment in down) < 0.3
    assert down[-1].height < 0.6 * spec.stand_height


def test_a_robot_that_stands_does_not_lie_down_to_stand_up() -> None:
    robot = Robot("a1")  # it spawns standing
    heights = [moment.height for moment in robot.do(Request.STAND, BridgeMode.STAND)]
    assert min(heights) > 0.85 * robot.config.robot.stand_height


def test_standing_up_that_is_broken_off_goes_down_from_where_it_is() -> None:
    robot = Robot("a1")
    robot.drop(robot.config.robot.q_lying)
    for moment in robot.do(Request.STAND, BridgeMode.STAND):
        if moment.height > 0.18:
            break
    down = list(robot.do(Request.LIE, BridgeMode.PASSIVE))
    assert robot.state.reason == ""
    assert max(moment.height for moment in down) < 0.22
    assert max(moment.falling for moment in down) < 0.3
