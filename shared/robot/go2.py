"""Unitree Go2."""

from __future__ import annotations

from typing import Final

from quadriga.shared.robot.spec import Geometry, RobotSpec

GO2: Final = RobotSpec(
    kind="go2",
    title="Unitree Go2",
    urdf="go2_description/urdf/go2.urdf",
    trunk_link="base",
    geometry=Geometry(
        hip_x=0.1934, hip_y=0.0465, thigh_y=0.0955, link=0.213, foot_radius=0.022, mass=16.085
    ),
    trunk_box=(0.3762, 0.0935, 0.114),
    imu=(-0.02557, 0.0, 0.04232),
    yoke=(0.0, 0.0, 0.08),
    torque=(23.7, 23.7, 45.43),
    speed=(30.1, 30.1, 15.7),
    lower=(*(2 * (-1.0472, -1.5708, -2.7227)), *(2 * (-1.0472, -0.5236, -2.7227))),
    upper=(*(2 * (1.0472, 3.4907, -0.83776)), *(2 * (1.0472, 4.5379, -0.83776))),
    stand_height=0.28,
    reach=0.396,
    defaults={"reference.height": 0.28},
)
