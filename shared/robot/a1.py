"""Unitree A1."""

from __future__ import annotations

from typing import Final

from quadriga.shared.robot.spec import Geometry, RobotSpec

A1: Final = RobotSpec(
    kind="a1",
    title="Unitree A1",
    urdf="a1_description/urdf/a1.urdf",
    trunk_link="trunk",
    # The URDF's trunk weighs 6.0 kg (13.741 kg in all); this gives the paper's 12.454 kg.
    trunk_mass=4.713,
    geometry=Geometry(
        hip_x=0.1805, hip_y=0.047, thigh_y=0.0838, link=0.2, foot_radius=0.02, mass=12.454
    ),
    trunk_box=(0.267, 0.194, 0.114),
    imu=(0.0, 0.0, 0.0),
    yoke=(0.0, 0.0, 0.08),
    torque=(33.5, 33.5, 33.5),
    speed=(21.0, 21.0, 21.0),
    lower=4 * (-0.802851455917, -1.0471975512, -2.69653369433),
    upper=4 * (0.802851455917, 4.18879020479, -0.916297857297),
    stand_height=0.26,
    reach=0.37,
)
