"""A kind of quadruped as data: what controller, world, pictures and checks know of it."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import GRAVITY, N_LEGS, Array

_FOLDED: Final = (0.0, 1.3, -2.6)  # rad: hip, thigh and calf of a leg that is folded
_PACKAGE: Final = "cmeel.prefix/share/example-robot-data/robots"


class Geometry(NamedTuple):
    """Lengths of a robot's legs for compiled code; left and right, front and rear are alike."""

    hip_x: float  # hip joint from the trunk's origin, forwards, m
    hip_y: float  # likewise, outwards, m
    thigh_y: float  # thigh joint from the hip joint, outwards, m
    link: float  # length of the thigh, and of the calf, m
    foot_radius: float  # m
    mass: float  # of the whole robot, kg


@dataclass(frozen=True)
class RobotSpec:
    """A kind of robot: four legs with a hip that turns about x, a thigh and a calf about y.

    Attributes:
        kind: its name in the configuration, `team.robot`.
        title: its name for people.
        urdf: of example-robot-data, below the folder of its robots.
        trunk_link: the URDF's link that is free in the world.
        geometry: of the legs, and the mass.
        trunk_box: full lengths of the trunk's collision box, (3,), m, about its origin.
        imu: where gyro and accelerometer are, (3,), m, trunk frame; their axes are the trunk's.
        yoke: where the ball joint of the yokes and the payload sit, (3,), m, trunk frame.
        torque: limits of the motors of hip, thigh and calf that stand or brake, (3,), N·m.
        driving_torque: likewise along a joint's own rotation, up to `corner_speed`, (3,), N·m.
        speed: likewise, (3,), rad/s.
        corner_speed: from which on their driving torque falls, linearly, to zero at `speed`, (3,),
            rad/s.
        continuous_torque: that they can give for any time without overheating, (3,), N·m.
        temperature_max: above which none of them may be for the robot to stand up, (3,), °C.
        rotor_inertia: of their rotors, as the joints feel it behind the gears, (3,), kg·m².
        lower, upper: limits of the joint angles, in the order of `JOINT_NAMES`, (12,), rad.
        stand_height: of the trunk's origin above the ground when it stands, m.
        reach: how far under the hip a foot may be lowered, m; the knee's stop allows little more.
        urdf_changes: attributes by the path of an element of the URDF, where the URDF is not
            believed.
        defaults: values by `section.key` that this robot has where the configuration says nothing.
    """

    kind: str
    title: str
    urdf: str
    trunk_link: str
    geometry: Geometry
    trunk_box: tuple[float, float, float]
    imu: tuple[float, float, float]
    yoke: tuple[float, float, float]
    torque: tuple[float, float, float]
    driving_torque: tuple[float, float, float]
    speed: tuple[float, float, float]
    corner_speed: tuple[float, float, float]
    continuous_torque: tuple[float, float, float]
    temperature_max: tuple[float, float, float]
    rotor_inertia: tuple[float, float, float]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    stand_height: float
    reach: float
    urdf_changes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    defaults: Mapping[str, Any] = field(default_factory=dict)

    @property
    def mass(self) -> float:
        """Of the whole robot, kg."""
        return self.geometry.mass

    @property
    def weight(self) -> float:
        """Of the whole robot, N."""
        return self.mass * GRAVITY

    @cached_property
    def torque_limit(self) -> Array:
        """Of every joint, in the order of `JOINT_NAMES`. Shape (12,), N·m."""
        return _read_only(np.tile(self.torque, N_LEGS))

    @cached_property
    def rotor_inertias(self) -> Array:
        """Of every joint, in the order of `JOINT_NAMES`. Shape (12,), kg·m²."""
        return _read_only(np.tile(self.rotor_inertia, N_LEGS))

    @cached_property
    def q_stand(self) -> Array:
        """Joint angles that put every foot under its hip at `stand_height`. Shape (12,), rad."""
        leg = self.geometry
        half_knee = float(np.arccos((self.stand_height - leg.foot_radius) / (2 * leg.link)))
        return _read_only(np.tile([0.0, half_knee, -2.0 * half_knee], N_LEGS))

    @cached_property
    def q_lying(self) -> Array:
        """Joint angles of a robot that lies on its feet with folded legs. Shape (12,), rad."""
        posture = np.tile(_FOLDED, N_LEGS)
        return _read_only(np.clip(posture, np.add(self.lower, 0.05), np.array(self.upper)))

    @property
    def lying_height(self) -> float:
        """Of the trunk's origin above the ground when it lies on its feet, m."""
        _, thigh, calf = self.q_lying[:3]
        leg = self.geometry
        return float(leg.foot_radius + leg.link * (np.cos(thigh) + np.cos(thigh + calf)))

    @cached_property
    def feet_under_hips(self) -> Array:
        """Where the feet stand under their hips, trunk frame. Shape (4, 2), m."""
        leg = self.geometry
        x, y = leg.hip_x, leg.hip_y + leg.thigh_y
        return _read_only(np.array([[x, y], [x, -y], [-x, y], [-x, -y]]))

    def urdf_tree(self) -> ET.Element:
        """The URDF with `urdf_changes` made: the one description of world and controller.

        Raises:
            ConfigError: the URDF is not installed, or has no such element.
        """
        root = ET.parse(self.urdf_path()).getroot()
        for path, attributes in self.urdf_changes.items():
            element = root.find(path)
            if element is None:
                raise ConfigError(self.urdf, f"no {path}", f"the URDF of the {self.title}")
            element.attrib.update(attributes)
        return root

    def urdf_path(self) -> Path:
        """Path of the URDF that the package example-robot-data installs.

        Raises:
            ConfigError: the package is not installed in this environment.
        """
        found = importlib.util.find_spec("cmeel")
        site = Path(found.origin).parent.parent if found and found.origin else Path()
        path = site / _PACKAGE / self.urdf
        if path.is_file():
            return path
        name, cause = f"description of the robot {self.title}", "`make install` installs it"
        raise ConfigError(name, f"no {path.name}", "the package example-robot-data", cause)


def _read_only(array: Array) -> Array:
    array.setflags(write=False)
    return array
