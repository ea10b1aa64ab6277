"""Packets of the A1 and the Go1 over UDP, as they are on the wire.

They are not the structs of Unitree's headers: the library packs torques and gains into 16 bits. The
layouts were read off packets that Unitree's own libraries sent and took.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.unitree.crc import crc32
from quadriga.shared.unitree.fields import Fields, Raw
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    NO_ANGLE,
    NO_RATE,
    SERVO,
    Battery,
    MotorTargets,
    RobotReport,
    check_crc,
    check_finite,
    check_size,
)

_Fields = Sequence[tuple[Any, ...]]

_MOTORS: Final = 20  # of which the robots have twelve
_LOW_LEVEL: Final = 0xFF
_HEAD: Final = b"\xfe\xef"
_SCALE: Final = {"tau": 256.0, "kp": 32.0, "kd": 16.0}  # steps per N·m, N·m/rad, N·m·s/rad
_STEPS_PER: Final = np.repeat([_SCALE["tau"], _SCALE["kp"], _SCALE["kd"]], N_JOINTS)
_STEPS: Final = np.iinfo(np.int16)
_CELLS: Final = 10
_CELL_V: Final = 0.032

_IMU: Final = np.dtype([
    ("quaternion", "<f4", 4), ("gyro", "<f4", 3), ("accel", "<f4", 3), ("rpy", "<f4", 3),
    ("temperature", "i1"),
])  # fmt: skip
_MOTOR_COMMAND: Final = np.dtype([
    ("mode", "u1"), ("q", "<f4"), ("dq", "<f4"), ("tau", "<i2"), ("kp", "<i2"), ("kd", "<i2"),
    ("reserve", "<u4", 3),
])  # fmt: skip
_MOTOR_STATE: Final = np.dtype([
    ("mode", "u1"), ("q", "<f4"), ("dq", "<f4"), ("ddq", "<i2"), ("tau", "<i2"), ("q_raw", "<f4"),
    ("dq_raw", "<f4"), ("ddq_raw", "<i2"), ("temperature", "i1"), ("reserve", "<u4", 2),
])  # fmt: skip
_BATTERY: Final = np.dtype([
    ("version_high", "u1"), ("version_low", "u1"), ("status", "u1"), ("charge", "u1"),
    ("current_ma", "<i4"), ("cycle", "<u2"), ("battery_ntc", "i1", 2), ("board_ntc", "i1", 2),
    ("cells", "u1", _CELLS),
])  # fmt: skip
_A1_HEAD: Final[_Fields] = [
    ("level", "u1"), ("version", "<u2"), ("robot_id", "<u2"), ("serial", "<u4"),
    ("bandwidth", "u1"),
]  # fmt: skip
_GO1_HEAD: Final[_Fields] = [
    ("head", "u1", 2), ("level", "u1"), ("frame_reserve", "u1"), ("serial", "<u4", 2),
    ("version", "<u4", 2), ("bandwidth", "<u2"),
]  # fmt: skip
_FEET: Final[_Fields] = [("foot", "<i2", 4), ("foot_estimate", "<i2", 4), ("tick", "<u4")]
_END: Final[_Fields] = [("remote", "u1", 40), ("reserve", "<u4"), ("crc", "<u4")]


class UdpCodec:
    """The packets of one kind of robot.

    Args:
        name: of the robot, for errors.
        command: layout of a command.
        report: layout of what the robot sends.

    Attributes:
        command, report: the layouts.
    """

    def __init__(self, name: str, command: np.dtype[np.void], report: np.dtype[np.void]) -> None:
        self.command, self.report = command, report
        self._name = name
        self._has_head = "head" in (command.names or ())
        self._has_battery = "battery" in (report.names or ())
        joints, feet = JOINT_PLACES, FOOT_PLACES
        self._asked_floats = Fields(command, motor__q=joints, motor__dq=joints)
        self._asked_steps = Fields(command, motor__tau=joints, motor__kp=joints, motor__kd=joints)
        self._asked_modes = Fields(command, motor__mode=joints)
        self._floats = Fields(
            report,
            imu__quaternion=None,
            imu__gyro=None,
            imu__accel=None,
            motor__q=joints,
            motor__dq=joints,
        )
        self._steps = Fields(report, motor__tau=joints, foot=feet)
        self._modes = Fields(report, motor__mode=joints)
        self._temperatures = Fields(report, motor__temperature=joints, imu__temperature=None)
        self._blank_command, self._blank_report = self._blank(command), self._blank(report)
        motors = self._blank_command["motor"]
        motors["mode"], motors["q"], motors["dq"] = SERVO, NO_ANGLE, NO_RATE  # of those it lacks

    def encode_command(self, targets: MotorTargets) -> bytes:
        """See `PacketCodec`. Torques and gains are cut towards zero, as Unitree's library does."""
        check_finite(targets)
        raw = np.frombuffer(self._blank_command.tobytes(), np.uint8).copy()
        self._asked_modes.write(raw, (targets.mode,))
        self._asked_floats.write(raw, (targets.q, targets.dq))
        steps = _STEPS_PER * np.concatenate((targets.tau, targets.kp, targets.kd))
        self._asked_steps.write(raw, (np.trunc(np.clip(steps, _STEPS.min, _STEPS.max)),))
        return _seal(raw)

    def decode_command(self, packet: bytes) -> MotorTargets:
        """See `PacketCodec`."""
        raw = self._open(packet, self.command, "command")
        (mode,) = self._asked_modes.read(raw, np.uint8)
        q, dq = self._asked_floats.read(raw, float)
        tau, kp, kd = self._asked_steps.read(raw, float)
        return MotorTargets(mode, q, dq, tau / _SCALE["tau"], kp / _SCALE["kp"], kd / _SCALE["kd"])

    def encode_report(self, report: RobotReport) -> bytes:
        """See `PacketCodec`."""
        raw = np.frombuffer(self._blank_report.tobytes(), np.uint8).copy()
        r = report
        self._floats.write(raw, (r.quat_wxyz, r.gyro, r.accel, r.q, r.dq))
        steps = np.rint(np.concatenate((_SCALE["tau"] * r.tau, r.foot)))
        self._steps.write(raw, (np.clip(steps, _STEPS.min, _STEPS.max),))
        self._modes.write(raw, (r.mode,))
        degrees = np.clip((*r.temperature, r.imu_temperature), -128, 127)
        self._temperatures.write(raw, (degrees,))
        fields = raw.view(self.report)[0]
        fields["tick"] = report.tick & 0xFFFFFFFF
        fields["remote"] = np.frombuffer(report.remote, np.uint8)
        if report.battery is not None and self._has_battery:
            _write_battery(fields["battery"], report.battery)
        return _seal(raw)

    def decode_report(self, packet: bytes) -> RobotReport:
        """See `PacketCodec`."""
        raw = self._open(packet, self.report, "report")
        quat, gyro, accel, q, dq = self._floats.read(raw, float)
        tau, foot = self._steps.read(raw, float)
        (mode,) = self._modes.read(raw, np.uint8)
        temperature, imu_temperature = self._temperatures.read(raw, float)
        fields = raw.view(self.report)[0]
        return RobotReport(
            tick=int(fields["tick"]),
            quat_wxyz=quat,
            gyro=gyro,
            accel=accel,
            q=q,
            dq=dq,
            tau=tau / _SCALE["tau"],
            foot=foot,
            mode=mode,
            temperature=temperature,
            imu_temperature=int(imu_temperature[0]),
            remote=fields["remote"].tobytes(),
            battery=_read_battery(fields["battery"]) if self._has_battery else None,
        )

    def _blank(self, layout: np.dtype[np.void]) -> Any:
        packet = np.zeros((), layout)
        packet["level"] = _LOW_LEVEL
        if self._has_head:
            packet["head"] = tuple(_HEAD)
        return packet

    def _open(self, packet: bytes, layout: np.dtype[np.void], what: str) -> Raw:
        """The bytes of a packet of this layout that is whole.

        Raises:
            PacketError: another length, or damaged.
        """
        what = f"{what} of the {self._name}"
        check_size(packet, layout.itemsize, what)
        got, level = int.from_bytes(packet[-4:], "little"), packet[2 if self._has_head else 0]
        check_crc(got, crc32(packet[: _covered(len(packet))]), what, level)
        return np.frombuffer(packet, np.uint8)


def _covered(size: int) -> int:
    """Bytes that the check sum covers: all whole words but the last, no rest before it."""
    return (size // 4 - 1) * 4


def _seal(packet: Raw) -> bytes:
    body = packet.tobytes()
    return body[:-4] + crc32(body[: _covered(len(body))]).to_bytes(4, "little")


def _write_battery(fields: Any, battery: Battery) -> None:
    fields["charge"], fields["current_ma"] = battery.charge, round(1000.0 * battery.current)
    if battery.voltage is not None:
        fields["cells"] = min(255, round(battery.voltage / (_CELLS * _CELL_V)))


def _read_battery(fields: Any) -> Battery:
    voltage = float(fields["cells"].sum()) * _CELL_V
    return Battery(int(fields["charge"]), 1e-3 * int(fields["current_ma"]), voltage)


A1: Final = UdpCodec(
    "A1",
    np.dtype([*_A1_HEAD, ("motor", _MOTOR_COMMAND, _MOTORS), ("led", "u1", (4, 3)), *_END]),
    np.dtype([*_A1_HEAD, ("imu", _IMU), ("motor", _MOTOR_STATE, _MOTORS), *_FEET, *_END]),
)
GO1: Final = UdpCodec(
    "Go1",
    np.dtype([*_GO1_HEAD, ("motor", _MOTOR_COMMAND, _MOTORS), ("battery", "u1", 4), *_END]),
    np.dtype([
        *_GO1_HEAD, ("imu", _IMU), ("motor", _MOTOR_STATE, _MOTORS), ("battery", _BATTERY),
        *_FEET, *_END,
    ]),
)  # fmt: skip
CODECS: Final = {"a1": A1, "go1": GO1}  # by the kind of robot
