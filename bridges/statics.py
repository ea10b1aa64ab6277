"""Where a robot of known angles and attitude is lowest."""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio

from quadriga.shared.robot.conventions import FOOT_FRAMES, Array
from quadriga.shared.robot.pinocchio_model import build_pinocchio_model
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.unitree.packets import RobotReport

_LIMB_RADIUS: Final = 0.02  # m, of knees
_HIP_RADIUS: Final = 0.04  # m, of the motors at hips


class Statics:
    """A kind of robot at rest.

    Args:
        robot: its kind.

    Raises:
        ConfigError: the URDF is not installed.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._model = build_pinocchio_model(robot)
        self._data = self._model.createData()
        self._feet = [self._model.getFrameId(foot) for foot in FOOT_FRAMES]
        self._foot_radius = robot.geometry.foot_radius
        box = np.array(np.meshgrid(*([-half, half] for half in np.array(robot.trunk_box) / 2)))
        self._corners = box.reshape(3, 8).T

    def lowest_points(self, report: RobotReport) -> tuple[Array, Array]:
        """Where the robot is lowest: feet, knees, hips and the corners of its trunk.

        Returns:
            Their places from the centre of mass, horizontally, (20, 2), and their heights over the
            lowest of them, (20,), m; world axes.
        """
        model, data = self._model, self._data
        w, x, y, z = report.quat_wxyz / np.linalg.norm(report.quat_wxyz)
        q = np.array([0.0, 0.0, 0.0, x, y, z, w, *report.q])
        com = pinocchio.centerOfMass(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        points = [
            *(data.oMf[foot].translation - [0.0, 0.0, self._foot_radius] for foot in self._feet),
            *(data.oMi[k].translation - [0.0, 0.0, _LIMB_RADIUS] for k in range(4, 14, 3)),
            *(data.oMi[k].translation - [0.0, 0.0, _HIP_RADIUS] for k in range(3, 14, 3)),
            *(self._corners @ data.oMi[1].rotation.T),
        ]
        places = np.array(points) - com
        return places[:, :2], places[:, 2] - places[:, 2].min()
