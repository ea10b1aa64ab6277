"""A robot that is dropped passive, and stands up from where it lies, in MuJoCo without a network.

`python -m tests.bridges.dropped` drops each kind of robot from random joint angles and prints how
many stood up and lay down again.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from typing import Final, NamedTuple

import mujoco
import numpy as np

from quadriga.bridges.supervisor import BridgeMode, Request, Supervisor, SupervisorInputs, tilt_of
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.unitree.packets import SERVO
from quadriga.sim_server.emulator.robot_emulator import RobotStatus
from quadriga.sim_server.world.world import World
from tests.bridges.robots import holding

_LYING: Final = 0.6  # rad, tilt above which a bridge refuses a robot


class Moment(NamedTuple):
    """One tick: the bridge's mode, height and vertical speed of the trunk, and its tilt."""

    mode: BridgeMode
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
        self._status = RobotStatus()
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
            report = self._status.report(state, heat, self._on)
            inputs = SupervisorInputs(now=tick, report=report, report_age=0, request=request)
            self.state, supervised = self._supervisor.step(self.state, inputs)
            if self.state.mode in (end, BridgeMode.STOPPED):
                return
            command = self._status.command(supervised.targets)
            self.world.step({} if command is None else {"r1": command})
            share = np.abs(self.world.motors.torque[0]) / self.config.robot.torque_limit
            self.torque = max(self.torque, float(share.max()))
            physics = self.world.physics
            quat = physics.qpos[3:7]
            yield Moment(
                self.state.mode, float(physics.qpos[2]), -float(physics.qvel[2]), tilt_of(quat)
            )

    def stand(self) -> list[Moment]:
        return list(self.do(Request.STAND, BridgeMode.STANDING))


def random_angles(kind: str, seed: int) -> Array:
    robot = ROBOTS[kind]
    lower, upper = np.array(robot.lower) + 0.03, np.array(robot.upper) - 0.03
    share = np.random.default_rng(seed).uniform(size=12)
    angles: Array = lower + share * (upper - lower)
    return angles


STOOD: Final = "stood up and lay down"
TILTED: Final = "refused: lies on its side"


def try_once(kind: str, seed: int) -> str:
    """What became of a robot that was dropped from random angles."""
    robot = Robot(kind)
    robot.drop(random_angles(kind, seed))
    if tilt_of(robot.world.physics.qpos[3:7]) > _LYING:
        return TILTED
    for request, end in ((Request.STAND, BridgeMode.STANDING), (Request.LIE, BridgeMode.PASSIVE)):
        moments = list(robot.do(request, end))
        if robot.state.mode is not end:
            return f"{moments[-1].mode} {robot.state.reason.partition(':')[0]}"
        height = robot.config.robot.stand_height
        if request is Request.STAND and abs(moments[-1].height / height - 1.0) > 0.1:
            return "stood too low"
    return STOOD


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=50, help="that lie on their feet or belly")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    for kind in ROBOTS:
        seen, seed = Counter[str](), arguments.seed
        while seen.total() - seen[TILTED] < arguments.tries:
            seen[try_once(kind, seed)] += 1
            seed += 1
        print(f"{kind}: {', '.join(f'{text} {n}' for text, n in seen.most_common())}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
