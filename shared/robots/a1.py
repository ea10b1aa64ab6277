"""Unitree A1 of 12.454 kg, as the paper's laboratory models its own and Unitree described it first.

The installed URDF is Unitree's later one, of 13.741 kg: `urdf_changes` has what differs, the trunk
and where hips and thighs are. The other links are alike in both.

Torques, speeds and angles are the URDF's. Unitree publishes a torque-speed curve of the Go2's motor
alone, see `go2`; corner speed and driving torque are the same shares of the speed limit and of the
peak. Rotor inertia: MuJoCo Menagerie, `unitree_a1`. Continuous torque: assumed, so that an A1 that
carries 3 kg overheats after minutes as in arXiv:2603.01631; no walk has been held against that.
Temperature: assumed, nobody publishes what this motor bears. Foot sensors and accelerometer:
unknown; the configuration's defaults assume the Go1's feet and the Go2's accelerometer.
"""

from __future__ import annotations

from typing import Final

from quadriga.shared.robots.spec import Geometry, RobotSpec

_INERTIAL: Final = "link[@name='trunk']/inertial/"
_LEGS: Final = (("FL", "", ""), ("FR", "", "-"), ("RL", "-", ""), ("RR", "-", "-"))  # signs of x, y

A1: Final = RobotSpec(
    kind="a1",
    title="Unitree A1",
    urdf="a1_description/urdf/a1.urdf",
    trunk_link="trunk",
    geometry=Geometry(
        hip_x=0.183, hip_y=0.047, thigh_y=0.08505, link=0.2, foot_radius=0.02, mass=12.454
    ),
    trunk_box=(0.267, 0.194, 0.114),
    imu=(0.0, 0.0, 0.0),
    yoke=(0.0, 0.0, 0.08),
    torque=(33.5, 33.5, 33.5),
    driving_torque=(28.9, 28.9, 28.9),
    speed=(21.0, 21.0, 21.0),
    corner_speed=(9.45, 9.45, 9.45),
    continuous_torque=(12.0, 12.0, 12.0),
    temperature_max=(70.0, 70.0, 70.0),
    rotor_inertia=(0.01, 0.01, 0.01),
    lower=4 * (-0.802851455917, -1.0471975512, -2.69653369433),
    upper=4 * (0.802851455917, 4.18879020479, -0.916297857297),
    stand_height=0.26,
    reach=0.355,
    urdf_changes={
        _INERTIAL + "mass": {"value": "4.713"},
        _INERTIAL + "origin": {"xyz": "0.012731 0.002186 0.000515"},
        _INERTIAL + "inertia": {
            **{"ixx": "0.01683993", "iyy": "0.056579028", "izz": "0.064713601"},
            **{"ixy": "8.3902e-05", "ixz": "0.000597679", "iyz": "2.5134e-05"},
        },
        **{
            f"joint[@name='{leg}_hip_joint']/origin": {"xyz": f"{x}0.183 {y}0.047 0"}
            for leg, x, y in _LEGS
        },
        **{
            f"joint[@name='{leg}_thigh_joint']/origin": {"xyz": f"0 {y}0.08505 0"}
            for leg, _, y in _LEGS
        },
    },
)
