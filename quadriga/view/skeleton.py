"""Where all links of some robots are, from poses of their trunks and angles of their joints."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from quadriga.shared.config.sections import MotorsConfig
from quadriga.shared.robots.conventions import FOOT_FRAMES, Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.sim_server.world.layout import ATTITUDE, JOINT_POSITIONS, NQ, POSITION
from quadriga.sim_server.world.robot_body import RobotBody

_ANY_RGBA = (1.0, 1.0, 1.0, 1.0)


class LinkPoses(NamedTuple):
    """Poses of the L links of n robots, in the order of `Skeleton.links`.

    Attributes:
        positions: world frame, shape (n, L, 3), m.
        quats: link to world, wxyz, shape (n, L, 4).
    """

    positions: Array
    quats: Array


class Skeleton:
    """The joints and links of n robots of a kind, without ground, yokes or dynamics.

    Attributes:
        links: names of a robot's links; the trunk is `trunk`, whatever the URDF calls it.
        feet: which of them are the feet, in the order of the legs.

    Raises:
        ConfigError: the robot's URDF is missing.
    """

    def __init__(self, robot: RobotSpec, count: int) -> None:
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        body = RobotBody(robot, MotorsConfig(), leg_collisions=False)
        for i in range(count):
            body.add_to(spec, f"{i}/", (0.0, 0.0, 0.0), 1.0, _ANY_RGBA)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._count = count
        per_robot = range(1, 1 + (self._model.nbody - 1) // count)  # body 0 is the world
        names = [str(self._model.body(k).name) for k in per_robot]
        self.links = tuple(name.partition("/")[2] for name in names)
        self.feet = tuple(self.links.index(foot) for foot in FOOT_FRAMES)

    def pose(self, trunk: Array, q_joint: Array) -> LinkPoses:
        """Poses of all links.

        Args:
            trunk: position and quaternion wxyz of each trunk, shape (n, 7).
            q_joint: joint angles, shape (n, 12), rad.
        """
        qpos = self._data.qpos.reshape(self._count, NQ)
        qpos[:, POSITION], qpos[:, ATTITUDE] = trunk[:, :3], trunk[:, 3:]
        qpos[:, JOINT_POSITIONS] = q_joint
        mujoco.mj_kinematics(self._model, self._data)
        shape = self._count, len(self.links)
        return LinkPoses(
            self._data.xpos[1:].reshape(*shape, 3).copy(),
            self._data.xquat[1:].reshape(*shape, 4).copy(),
        )


def rotate(quat_wxyz: Array, vector: Array) -> Array:
    """Vectors turned by quaternions, both of any shape that fits: R(q) v. Shape (…, 3)."""
    w, u = quat_wxyz[..., :1], quat_wxyz[..., 1:]
    across = np.cross(u, vector)
    turned: Array = vector + 2.0 * (w * across + np.cross(u, across))
    return turned
