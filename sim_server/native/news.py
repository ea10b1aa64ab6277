"""What is worth telling of simulated robots: what their motors do, who stands, lies or falls.

Pure: from a tick's commands and true positions to lines of text, each with the tick it is about.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Final

import numpy as np

from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.terrain.terrain import Terrain
from quadriga.sim_server.world.layout import JOINT_RATES, NQ, NV, POSE
from quadriga.sim_server.world.world import World

OFF, DAMPED, DRIVEN = "motors off", "motors damped", "motors driven"
LOST: Final = "behind real time in a second: this computer is too slow"
LASTS_MS: Final = 20  # for which motors do something before it is told
_BRAKING: Final = 3.0  # N·m by which a damping motor's torque may differ from what brakes
_STANDS: Final = 0.75  # share of the height of its stand
_UPRIGHT: Final = math.cos(0.5)  # of the tilt of one that stands
_STANDS_MS: Final = 200  # for which it does
_SECOND: Final = 1000  # ms
_LOOK_MS: Final = 10  # between two looks at one that does not
_FALLEN: Final = math.cos(1.0)  # of the tilt of one that has fallen, as the world has it
_LOW: Final = 0.12  # m, trunk above the ground, of one that is down, as the world has it
_GENTLE: Final = 0.8  # m/s: who comes down upright and more slowly, as a damped one does, lies


def describe_motors(command: Command | None, rates: Array) -> str:
    """What the motors do under a command: off, damped or driven.

    They are damped if none is stiff and each gives no more than what brakes its joint: a bridge
    that damps a robot keeps its limits of torque, and takes something off. A motor in protection
    mode gives nothing.

    Args:
        command: None: off.
        rates: of the joints, (12,), rad/s.
    """
    if command is None:
        return OFF
    if command.kp.any():
        return DRIVEN
    if not command.tau.any():
        return DAMPED if command.kd.any() else OFF
    braking = command.kd * np.abs(command.v_des - rates) + _BRAKING
    damped = command.kd.any() and (np.abs(command.tau) <= braking).all()
    return DAMPED if damped else DRIVEN


class MotorNews:
    """Tells what one robot's motors do once it has lasted.

    Two writers, each with another command, would fill the screen otherwise. The tick told is the
    one at which it began.
    """

    def __init__(self) -> None:
        self._told = self._doing = OFF
        self._since = 0  # tick

    def look(self, now: int, doing: str) -> str:
        """The news of a tick; mostly ""."""
        if doing != self._doing:
            self._doing, self._since = doing, now
        if doing == self._told or now - self._since < LASTS_MS:
            return ""
        return self.last()

    def last(self) -> str:
        """What has not been told yet, as when all ends; mostly ""."""
        if self._doing == self._told:
            return ""
        self._told = self._doing
        return f"{self._since} ms: {{name}} {self._doing}"


class LostTime:
    """Tells once a second how much behind real time robots fell that this computer is too slow for.

    What they then do says nothing of robots, which never wait.
    """

    def __init__(self) -> None:
        self._told = 0.0

    def look(self, now: int, lost: float) -> str:
        """The news of a tick; mostly "".

        Args:
            now: tick, ms.
            lost: real time that has been lost in all, s.
        """
        if now % _SECOND or (ms := round(1000.0 * (lost - self._told))) == 0:
            return ""
        self._told = lost
        return f"{now} ms: {ms} ms {LOST}"


class PostureNews:
    """Tells that one robot stands, has lain down or has fallen. That it lies at first is no news.

    Args:
        stand_height: of its trunk, m.
        terrain: for the ground's height.
        feet_under_hips: where its feet stand, see `RobotSpec`.
    """

    def __init__(self, stand_height: float, terrain: Terrain, feet_under_hips: Array) -> None:
        self._high = _STANDS * stand_height
        self._terrain, self._feet = terrain, feet_under_hips
        self._surely_up = self._high + terrain.top
        self._stands = False
        self._up_since: int | None = None

    def look(self, now: int, pose: Array, sinking: float) -> str:
        """The news of a tick; mostly "".

        Args:
            now: tick, ms.
            pose: of the trunk: position and quaternion wxyz, (7,), world.
            sinking: speed of its trunk downwards, m/s.
        """
        if not self._stands and now % _LOOK_MS:
            return ""
        x, y, z, qw, qx, qy, qz = pose.tolist()
        cosine = 1.0 - 2.0 * (qx * qx + qy * qy)
        # With these comparisons a state that is not a number counts as a fall.
        if self._stands and cosine >= _FALLEN and z >= self._surely_up:
            return ""
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        ground = self._terrain.height_under_hips(
            np.array(x), np.array(y), np.array(yaw), self._feet
        )
        above = z - float(ground)
        if not self._stands:
            return self._rise(now, up=above >= self._high and cosine >= _UPRIGHT)
        if cosine >= _FALLEN and above >= _LOW:
            return ""
        self._stands, self._up_since = False, None
        if cosine >= _FALLEN and sinking <= _GENTLE:
            return f"{now} ms: {{name}} lies, {sinking:.2f} m/s down"
        tilt = math.acos(max(-1.0, min(1.0, cosine)))
        return (
            f"{now} ms: fall {{name}} tilt {tilt:.2f} rad, height {above:.3f} m, "
            f"{sinking:.2f} m/s down"
        )

    def _rise(self, now: int, *, up: bool) -> str:
        if not up:
            self._up_since = None
            return ""
        if self._up_since is None:
            self._up_since = now
        if now - self._up_since < _STANDS_MS:
            return ""
        self._stands = True
        return f"{self._up_since} ms: {{name}} stands"


class News:
    """The news of all robots of a world."""

    def __init__(self, world: World, robot_height: float, feet_under_hips: Array) -> None:
        self._world, n = world, len(world.names)
        self._q = world.physics.qpos[: n * NQ].reshape(n, NQ)
        self._v = world.physics.qvel[: n * NV].reshape(n, NV)
        self._motors = [MotorNews() for _ in world.names]
        terrain = world.team.terrain
        self._postures = [PostureNews(robot_height, terrain, feet_under_hips) for _ in world.names]

    def of_motors(self, commands: Mapping[str, Command | None]) -> list[str]:
        """Of the commands that the motors follow in this tick."""
        now, lines = self._world.tick, list[str]()
        for k, name in enumerate(self._world.names):
            doing = describe_motors(commands[name], self._v[k, JOINT_RATES])
            if line := self._motors[k].look(now, doing):
                lines.append(line.format(name=name))
        return lines

    def of_postures(self, hung: Collection[str]) -> list[str]:
        """Of this tick's true positions; of robots that hang there is none."""
        now, lines = self._world.tick, []
        for k, name in enumerate(self._world.names):
            if name in hung:
                continue
            if line := self._postures[k].look(now, self._q[k, POSE], -float(self._v[k, 2])):
                lines.append(line.format(name=name))
        return lines

    def rest(self) -> list[str]:
        """What has not been told yet when all ends."""
        pairs = zip(self._motors, self._world.names, strict=True)
        return [line.format(name=name) for news, name in pairs if (line := news.last())]
