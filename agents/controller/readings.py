"""What a robot's sensors measure, as compiled code takes it."""

from __future__ import annotations

from typing import Final, NamedTuple

from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

# Where `State.row` keeps what.
_Q_JOINT: Final = State.CUTS["q_joint"]
_V_JOINT: Final = State.CUTS["v_joint"]
_TAU_JOINT: Final = State.CUTS["tau_joint"]
_QUAT: Final = State.CUTS["imu_quat_wxyz"]
_GYRO: Final = State.CUTS["imu_gyro"]
_ACCEL: Final = State.CUTS["imu_accel"]
_FOOT_FORCE: Final = State.CUTS["foot_force"]


class Readings(NamedTuple):
    """What the sensors measure, see `State`.

    Attributes:
        q_joint: joint angles, (12,), rad.
        v_joint: joint rates, (12,), rad/s.
        tau_joint: joint torques, (12,), N·m.
        quat_wxyz: attitude of the IMU, trunk to world, (4,).
        gyro: angular velocity, (3,), rad/s, trunk frame.
        accel: specific force, (3,), m/s², trunk frame.
        foot_force: what the foot sensors give, (4,), counts.
    """

    q_joint: Array
    v_joint: Array
    tau_joint: Array
    quat_wxyz: Array
    gyro: Array
    accel: Array
    foot_force: Array


@compiled
def readings_of(state: Array) -> Readings:
    """Views of a `State.row`."""
    return Readings(
        state[_Q_JOINT],
        state[_V_JOINT],
        state[_TAU_JOINT],
        state[_QUAT],
        state[_GYRO],
        state[_ACCEL],
        state[_FOOT_FORCE],
    )


@compiled
def with_imu(readings: Readings, quat_wxyz: Array, accel: Array) -> Readings:
    """The same readings with another attitude and specific force."""
    return Readings(
        readings.q_joint,
        readings.v_joint,
        readings.tau_joint,
        quat_wxyz,
        readings.gyro,
        accel,
        readings.foot_force,
    )
