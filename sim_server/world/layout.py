"""Layout of a robot's rows of MuJoCo's arrays `qpos`, `qvel` and `sensordata`."""

from __future__ import annotations

from typing import Final

from quadriga.shared.robots.conventions import N_JOINTS, N_LEGS

POSITION: Final = slice(0, 3)  # of `qpos`: trunk origin, world, m
ATTITUDE: Final = slice(3, 7)  # of `qpos`: trunk to world, quaternion wxyz
POSE: Final = slice(0, 7)  # of `qpos`: both
JOINT_POSITIONS: Final = slice(7, 7 + N_JOINTS)  # of `qpos`, rad
NQ: Final = JOINT_POSITIONS.stop  # positions of one robot

VELOCITY: Final = slice(0, 3)  # of `qvel`: trunk origin, world, m/s
TRUNK_RATE: Final = slice(3, 6)  # of `qvel`: trunk frame, rad/s
JOINT_RATES: Final = slice(6, 6 + N_JOINTS)  # of `qvel`, rad/s; so are torques in `qfrc_applied`
NV: Final = JOINT_RATES.stop  # velocities of one robot

# Of `sensordata`, behind the gyro (3):
SPECIFIC_FORCE: Final = slice(3, 6)  # trunk frame, m/s²
FOOT_FORCES: Final = slice(6, 6 + N_LEGS)  # normal force by foot, N
CONTACT_FORCES: Final = slice(10, 10 + 3 * N_LEGS)  # of each foot on the ground, world, N
N_SENSORS: Final = CONTACT_FORCES.stop  # of one robot
