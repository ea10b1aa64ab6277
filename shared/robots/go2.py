"""Unitree Go2.

Angles are the URDF's. Torques and speeds: Unitree's torque-speed curve of this motor
(`UnitreeActuatorCfg_Go2HV` of unitree_rl_lab: 20.2 N·m driving up to 13.5 rad/s, none at 30 rad/s,
23.4 N·m braking); the knee has a gear that is slower by the URDF's 30.1/15.7. The URDF's limits,
23.7 and 45.43 N·m, are above it. Rotor inertia: that of the Go1's motor, 1.118e-4 kg·m²,
behind a gear of 6.33 (data sheet of GO-M8010-6) and the knee's. Continuous torque: the same share
of the peak as the A1's. Temperature: as the Go1's; a real one stood with calves of 72 and 78 °C.

Sensors: measured roughly on two Go2, 0.65 counts per N of their feet and 15 counts without load; of
one that lies, an accelerometer that is off by (-0.23, 0.13, -0.18) m/s². Assumed: all else of the
feet, as the Go1's in N.
"""

from __future__ import annotations

from typing import Final

from quadriga.shared.robots.spec import Geometry, RobotSpec

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
    torque=(23.4, 23.4, 44.9),
    driving_torque=(20.2, 20.2, 38.7),
    speed=(30.0, 30.0, 15.65),
    corner_speed=(13.5, 13.5, 7.04),
    continuous_torque=(8.4, 8.4, 16.1),
    temperature_max=(80.0, 80.0, 80.0),
    rotor_inertia=(0.00448, 0.00448, 0.01646),
    lower=(*(2 * (-1.0472, -1.5708, -2.7227)), *(2 * (-1.0472, -0.5236, -2.7227))),
    upper=(*(2 * (1.0472, 3.4907, -0.83776)), *(2 * (1.0472, 4.5379, -0.83776))),
    stand_height=0.28,
    reach=0.385,
    defaults={
        "reference.height": 0.28,
        "sensors.foot_scale": 0.65,
        "sensors.foot_offset": 15.0,
        "sensors.foot_bias": 1.6,
        "sensors.foot_drift": 0.08,
    },
)
