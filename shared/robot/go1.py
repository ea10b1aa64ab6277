"""Unitree Go1."""

from __future__ import annotations

from typing import Final

from quadriga.shared.robot.spec import Geometry, RobotSpec

GO1: Final = RobotSpec(
    kind="go1",
    title="Unitree Go1",
    urdf="go1_description/urdf/go1.urdf",
    trunk_link="trunk",
    geometry=Geometry(
        hip_x=0.1881, hip_y=0.04675, thigh_y=0.08, link=0.213, foot_radius=0.02, mass=13.100529
    ),
    trunk_box=(0.3762, 0.0935, 0.114),
    imu=(-0.01592, -0.06659, -0.00617),
    yoke=(0.0, 0.0, 0.08),
    torque=(23.7, 23.7, 35.55),
    speed=(30.1, 30.1, 20.06),
    lower=4 * (-0.863, -0.686, -2.818),
    upper=4 * (0.863, 4.501, -0.888),
    stand_height=0.28,
    reach=0.396,
    defaults={"reference.height": 0.28},
)
