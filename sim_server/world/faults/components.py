"""What of a robot can be faulty: its parts of a `State` or a `Command`, and what they read then."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import JOINT_NAMES, N_JOINTS, Array, Leg
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.wire.messages import Command, Flat, State

_OFF_BY: Final = 0.2  # rad, an angle that is wrong
_GYRO_MOST: Final = 35.0  # rad/s, 2000 °/s: the range of usual gyros
_ACCEL_MOST: Final = 157.0  # m/s², 16 g: the range of usual accelerometers
_FOOT_MOST: Final = 500.0  # counts, or N: more than a foot of such a robot presses

Columns = NDArray[np.intp]


class Component(NamedTuple):
    """A part of a robot that can be faulty.

    Attributes:
        message: `State` of a sensor, `Command` of a motor.
        columns: its numbers in the message's row.
        wrong: from sound numbers to those that it has when it is wrong.
        low, high: between these it draws its numbers when it gives garbage.
        unit_length: whether its numbers are an orientation: garbage has unit length.
    """

    message: type[Flat]
    columns: Columns
    wrong: Callable[[Array], Array]
    low: Array
    high: Array
    unit_length: bool = False


def build_components(robot: RobotSpec) -> Mapping[str, tuple[Component, ...]]:
    """What of a kind of robot can be faulty, by name, with its parts.

    Sensors are `imu`, its parts `attitude`, `gyro` and `accel`, `encoders` with angle and rate of
    all joints and `encoder_FL_hip` …, `feet` and `foot_FL` …; motors are `motors`, `motor_FL` with
    the three of a leg …, and `motor_FL_hip` ….
    """
    sensors = _build_sensors(robot)
    imu = tuple(sensors[name] for name in ("attitude", "gyro", "accel"))
    single = {name: (part,) for name, part in {**sensors, **_build_motors(robot)}.items()}
    return {"imu": imu, **single}


def _build_sensors(robot: RobotSpec) -> dict[str, Component]:
    cuts, joints = State.CUTS, np.arange(N_JOINTS)
    attitude = Component(
        State,
        _columns(cuts["imu_quat_wxyz"]),
        _tilt,
        np.full(4, -1.0),
        np.ones(4),
        unit_length=True,
    )
    gyro = _symmetric(_columns(cuts["imu_gyro"]), np.full(3, _GYRO_MOST))
    accel = _symmetric(_columns(cuts["imu_accel"]), np.full(3, _ACCEL_MOST))
    feet = _columns(cuts["foot_force"])
    found = {"attitude": attitude, "gyro": gyro, "accel": accel}
    found["encoders"] = _encoders(robot, joints)
    for joint, name in enumerate(_joint_names()):
        found[f"encoder_{name}"] = _encoders(robot, joints[joint : joint + 1])
    found["feet"] = _feet(feet)
    for leg in Leg:
        found[f"foot_{leg.name}"] = _feet(feet[leg : leg + 1])
    return found


def _build_motors(robot: RobotSpec) -> dict[str, Component]:
    joints = np.arange(N_JOINTS)
    found = {"motors": _motors(robot, joints)}
    for leg in Leg:
        found[f"motor_{leg.name}"] = _motors(robot, joints[3 * leg : 3 * leg + 3])
    for joint, name in enumerate(_joint_names()):
        found[f"motor_{name}"] = _motors(robot, joints[joint : joint + 1])
    return found


def _joint_names() -> tuple[str, ...]:
    return tuple(name.removesuffix("_joint") for name in JOINT_NAMES)


def _columns(cut: slice) -> Columns:
    return np.arange(cut.start, cut.stop)


def _symmetric(columns: Columns, most: Array) -> Component:
    return Component(State, columns, np.negative, -most, most)


def _feet(columns: Columns) -> Component:
    n = len(columns)
    return Component(State, columns, np.negative, np.zeros(n), np.full(n, _FOOT_MOST))


def _encoders(robot: RobotSpec, joints: Columns) -> Component:
    n, speed = len(joints), np.tile(robot.speed, 4)[joints]
    columns = np.concatenate(
        [_columns(State.CUTS[name])[joints] for name in ("q_joint", "v_joint")]
    )
    low = np.concatenate([np.array(robot.lower)[joints], -speed])
    high = np.concatenate([np.array(robot.upper)[joints], speed])

    def be_wrong(values: Array) -> Array:
        return np.concatenate([values[:n] + _OFF_BY, -values[n:]])

    return Component(State, columns, be_wrong, low, high)


def _motors(robot: RobotSpec, joints: Columns) -> Component:
    """Motors of these joints; a wrong one gives the opposite torque."""
    n, torque = len(joints), robot.torque_limit[joints]
    fields = ("tau", "kp", "kd", "q_des", "v_des")
    columns = np.concatenate([_columns(Command.CUTS[name])[joints] for name in fields])
    high = np.concatenate([torque, np.zeros(4 * n)])

    def be_wrong(values: Array) -> Array:
        return np.concatenate([-values[: 3 * n], values[3 * n :]])

    return Component(Command, columns, be_wrong, -high, high)


def _tilt(quat_wxyz: Array) -> Array:
    """The orientation, turned by `_OFF_BY` about the trunk's x axis."""
    c, s = np.cos(0.5 * _OFF_BY), np.sin(0.5 * _OFF_BY)
    w, x, y, z = quat_wxyz
    return np.array([c * w - s * x, c * x + s * w, c * y + s * z, c * z - s * y])
