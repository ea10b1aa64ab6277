"""Unitree A1.

Torques, speeds and angles are the URDF's. Unitree publishes a torque-speed curve of the Go2's motor
alone, see `go2`; the corner speed is the same share of the speed limit. Rotor inertia: MuJoCo
Menagerie, `unitree_a1`. Continuous torque: assumed, so that an A1 that carries 3 kg
overheats after minutes as in arXiv:2603.01631; no walk has been held against that. Foot sensors and
accelerometer: unknown; the configuration's defaults assume the Go1's feet and the Go2's
accelerometer.
"""

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
    corner_speed=(9.45, 9.45, 9.45),
    continuous_torque=(12.0, 12.0, 12.0),
    rotor_inertia=(0.01, 0.01, 0.01),
    lower=4 * (-0.802851455917, -1.0471975512, -2.69653369433),
    upper=4 * (0.802851455917, 4.18879020479, -0.916297857297),
    stand_height=0.26,
    reach=0.355,
)
