"""Unitree Go1.

Torques, speeds and angles are the URDF's, and so is the rotors' inertia: 1.118e-4 kg·m² in
`FL_hip_rotor` and its like, behind a gear of 6, at the knee of 9. Unitree publishes a torque-speed
curve of the Go2's motor alone, see `go2`; corner speed and driving torque are the same shares of
the speed limit and of the peak.
Continuous torque: the same share of the peak as the A1's. Temperature: these motors protect
themselves at 90 °C (unitree_actuator_sdk, GO-M8010-6); a bridge stops them 2 °C before.

Foot sensors are the configuration's defaults, measured on a walking Go1, 130 foot-seconds: 11.4 to
13.3 counts per N, 100 to 160 counts without load, noise of 0.5 to 0.75 counts, at most 3 to 7
counts of drift in 21 s, new counts 49 times a second. Assumed: dropouts, of which there were none,
and the accelerometer, the Go2's.
"""

from __future__ import annotations

from typing import Final

from quadriga.shared.robots.spec import Geometry, RobotSpec

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
    driving_torque=(20.5, 20.5, 30.7),
    speed=(30.1, 30.1, 20.06),
    corner_speed=(13.5, 13.5, 9.0),
    continuous_torque=(8.5, 8.5, 12.75),
    temperature_max=(80.0, 80.0, 80.0),
    rotor_inertia=(0.00403, 0.00403, 0.00906),
    lower=4 * (-0.863, -0.686, -2.818),
    upper=4 * (0.863, 4.501, -0.888),
    stand_height=0.28,
    reach=0.38,
    defaults={"reference.height": 0.28},
)
