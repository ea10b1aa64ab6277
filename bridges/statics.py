"""What the feet of a robot that stands still bear."""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio

from quadriga.shared.robot.conventions import FOOT_FRAMES, N_LEGS, Array
from quadriga.shared.robot.pinocchio_model import build_pinocchio_model
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.unitree.packets import RobotReport

_LIMB_RADIUS: Final = 0.02  # m, of knees
_HIP_RADIUS: Final = 0.04  # m, of the motors at hips
_LEG_COLUMNS: Final = [slice(6 + 3 * k, 9 + 3 * k) for k in range(N_LEGS)]


class Statics:
    """The equilibrium of a kind of robot on four feet.

    Args:
        robot: its kind.

    Raises:
        ConfigError: the URDF is not installed.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._model = build_pinocchio_model(robot)
        self._data = self._model.createData()
        self._feet = [self._model.getFrameId(foot) for foot in FOOT_FRAMES]
        self._weight, self._foot_radius = robot.weight, robot.geometry.foot_radius
        box = np.array(np.meshgrid(*([-half, half] for half in np.array(robot.trunk_box) / 2)))
        self._corners = box.reshape(3, 8).T

    def foot_loads(self, report: RobotReport, *, alone: bool) -> Array:
        """Vertical forces of the ground on the feet, (4,), N.

        The joints' torques tell each foot's force, with the error of friction in the joints:
        f = J⁻ᵀ (g − τ). Of a robot that is alone, these are the nearest to those of all forces that
        carry its weight and have their centre of pressure below the centre of mass. What a yoke
        adds is as unknown as what is missing there.

        Args:
            report: what the robot measures.
            alone: whether nothing but the ground bears it: no yoke pulls at it.
        """
        model, data = self._model, self._data
        w, x, y, z = report.quat_wxyz
        q = np.array([0.0, 0.0, 0.0, x, y, z, w, *report.q])
        gravity = pinocchio.computeGeneralizedGravity(model, data, q)
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        com = pinocchio.centerOfMass(model, data, q)
        by_torque, arms = np.empty(N_LEGS), np.ones((3, N_LEGS))
        for leg, (foot, columns) in enumerate(zip(self._feet, _LEG_COLUMNS, strict=True)):
            J = pinocchio.getFrameJacobian(
                model, data, foot, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )[:3, columns]
            joints = slice(3 * leg, 3 * leg + 3)
            by_torque[leg] = np.linalg.lstsq(J.T, gravity[columns] - report.tau[joints])[0][2]
            arms[1:, leg] = (data.oMf[foot].translation - com)[:2]
        if not alone:
            return by_torque
        missing = np.array([self._weight, 0.0, 0.0]) - arms @ by_torque
        loads: Array = by_torque + np.linalg.lstsq(arms, missing)[0]
        return loads

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
