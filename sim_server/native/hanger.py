"""Robots that hang in the air: a rope and a frame at each trunk, as in a test of joints.

A trunk is held by a spring and a damper: in place, level and in its heading. The rope pulls up and
never down, so that a robot that is lowered comes to stand on its legs, and the rope becomes slack;
then it is let go of. The force acts at the trunk's centre of mass, close to the origin whose place
is held.
"""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from quadriga.shared.robot.conventions import GRAVITY, Array
from quadriga.sim_server.world import layout
from quadriga.sim_server.world.world import World

HUNG_HEIGHT: Final = 0.6  # m above the ground under the trunk
_SPEED: Final = 0.2  # m/s, of the rope's end when it is pulled up or let down
_QUICKNESS: Final = 40.0  # rad/s, of the trunk on its spring; critically damped
_STIFFNESS: Final = 400.0  # N·m/rad
_DAMPING: Final = 8.0  # N·m·s/rad
_MOST_TILT: Final = 0.3  # rad: a robot that lay on its side is not turned with all might
_SLACK: Final = 0.03  # m by which the rope's end is below what it held: it holds nothing any more


class Hanger:
    """What holds the robots of a world; nobody at first.

    While a robot hangs, pushes do not act on it.

    Args:
        world: its trunks get forces through MuJoCo's `xfrc_applied`.
    """

    def __init__(self, world: World) -> None:
        self._world, self._physics = world, world.physics
        n = len(world.names)
        self._q = self._physics.qpos[: n * layout.NQ].reshape(n, layout.NQ)
        self._v = self._physics.qvel[: n * layout.NV].reshape(n, layout.NV)
        model = world.team.model
        self._masses = [float(model.body_subtreemass[trunk]) for trunk in world.team.trunks]
        self._ropes: dict[int, _Rope] = {}

    @property
    def hung(self) -> tuple[str, ...]:
        """Names of the robots that are held."""
        return tuple(self._world.names[k] for k in self._ropes)

    def spawn_hung(self) -> None:
        """Have all robots hang from the start, at rest and with their legs as they are."""
        for k, name in enumerate(self._world.names):
            rope = self._ropes[k] = self._rope(name)
            rope.end = self._q[k, 2] = rope.top
        mujoco.mj_forward(self._world.team.model, self._physics)

    def pull_up(self, name: str) -> None:
        """Pull a robot up from where it is."""
        self._ropes[self._world.names.index(name)] = self._rope(name)

    def let_down(self, name: str) -> None:
        """Let a robot down, until it stands or lies by itself."""
        rope = self._ropes.get(self._world.names.index(name))
        if rope is not None:
            rope.falls = True

    def hold(self) -> None:
        """Apply this tick's forces. Call it before each step of the world."""
        for k, rope in list(self._ropes.items()):
            rope.move()
            trunk = self._world.team.trunks[k]
            if rope.falls and self._q[k, 2] - rope.end > _SLACK:
                del self._ropes[k]
                self._physics.xfrc_applied[trunk] = 0.0
                continue
            self._physics.xfrc_applied[trunk] = rope.wrench(self._q[k], self._v[k])

    def _rope(self, name: str) -> _Rope:
        k = self._world.names.index(name)
        x, y, z, qw, qx, qy, qz = self._q[k, layout.POSE].tolist()
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        ground = float(self._world.team.terrain.height(np.array(x), np.array(y)))
        return _Rope(np.array([x, y]), yaw, z, ground + HUNG_HEIGHT, self._masses[k])


class _Rope:
    """What holds one trunk.

    Args:
        place: x and y that it is held at, m, world.
        yaw: its heading, rad.
        end: height that the rope's end is at, m, world.
        top: height that it is pulled to.
        mass: that hangs on it, kg.
    """

    def __init__(self, place: Array, yaw: float, end: float, top: float, mass: float) -> None:
        self.end, self.top, self.falls = end, top, False
        self._place, self._mass = place, mass
        self._level = np.array([math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)])
        self._turn, self._torque = np.zeros(3), np.zeros(3)
        self._wrench = np.zeros(6)

    def move(self) -> None:
        """Pull the rope in, or let it out, for a tick."""
        step = 1e-3 * _SPEED
        self.end = self.end - step if self.falls else min(self.top, self.end + step)

    def wrench(self, q: Array, v: Array) -> Array:
        """Force and torque on the trunk, world frame, (6,), N and N·m.

        F = m (ω² (p* − p) − 2 ω v) + m g ẑ,  F_z ≥ 0;  T = R (−k ϑ − d w)

        Args:
            q: coordinates of the robot, (19,), see `layout`.
            v: its velocities, (18,).
        """
        force, omega = self._wrench[:3], _QUICKNESS
        force[:2] = omega**2 * (self._place - q[:2])
        force[2] = omega**2 * (self.end - q[2]) + GRAVITY
        force -= 2.0 * omega * v[layout.VELOCITY]
        force *= self._mass
        force[2] = max(0.0, force[2])
        mujoco.mju_subQuat(self._turn, q[layout.ATTITUDE], self._level)
        tilt = float(np.linalg.norm(self._turn))
        if tilt > _MOST_TILT:
            self._turn *= _MOST_TILT / tilt
        self._torque[:] = -_STIFFNESS * self._turn - _DAMPING * v[layout.TRUNK_RATE]
        mujoco.mju_rotVecQuat(self._wrench[3:], self._torque, q[layout.ATTITUDE])
        return self._wrench
