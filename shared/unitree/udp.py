"""Packets of the A1 and the Go1 over UDP, as they are on the wire.

They are not the structs of Unitree's headers: the library packs torques and gains into 16 bits. The
layouts were read off packets that Unitree's own libraries sent and took.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.unitree.crc import crc32
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    NO_ANGLE,
    NO_RATE,
    SERVO,
    Battery,
    MotorTargets,
    PacketError,
    RobotReport,
    check_crc,
    check_finite,
    check_size,
    to_project,
)

_Fields = Sequence[tuple[Any, ...]]

_MOTORS: Final = 20  # of which the robots have twelve
_LOW_LEVEL: Final = 0xFF
_HEAD: Final = (0xFE, 0xEF)
_SCALE: Final = {"tau": 256.0, "kp": 32.0, "kd": 16.0}  # steps per N·m, N·m/rad, N·m·s/rad
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


@dataclass(frozen=True)
class UdpCodec:
    """The packets of one kind of robot.

    Attributes:
        name: of the robot, for errors.
        command: layout of a command.
        report: layout of what the robot sends.
    """

    name: str
    command: np.dtype[np.void]
    report: np.dtype[np.void]

    def encode_command(self, targets: MotorTargets) -> bytes:
        """See `PacketCodec`. Torques and gains are cut towards zero, as Unitree's library does."""
        check_finite(targets)
        packet = self._blank(self.command)
        motors = packet["motor"]
        motors["mode"], motors["q"], motors["dq"] = SERVO, NO_ANGLE, NO_RATE  # of those it lacks
        rows = motors[:N_JOINTS]
        rows["mode"] = targets.mode[JOINT_PLACES]
        for name in ("q", "dq"):
            rows[name] = getattr(targets, name)[JOINT_PLACES]
        for name, scale in _SCALE.items():
            limited = np.clip(getattr(targets, name), _STEPS.min / scale, _STEPS.max / scale)
            rows[name] = np.trunc(scale * limited[JOINT_PLACES])
        return _seal(packet)

    def decode_command(self, packet: bytes) -> MotorTargets:
        """See `PacketCodec`."""
        fields = self._open(packet, self.command, f"command of the {self.name}")
        rows = fields["motor"][:N_JOINTS][JOINT_PLACES]
        scaled = {name: rows[name] / scale for name, scale in _SCALE.items()}
        return MotorTargets(
            rows["mode"].copy(), rows["q"].astype(float), rows["dq"].astype(float), **scaled
        )

    def encode_report(self, report: RobotReport) -> bytes:
        """See `PacketCodec`."""
        packet = self._blank(self.report)
        imu, rows = packet["imu"], packet["motor"][:N_JOINTS]
        imu["quaternion"], imu["gyro"], imu["accel"] = report.quat_wxyz, report.gyro, report.accel
        imu["temperature"] = report.imu_temperature
        rows["mode"] = report.mode[JOINT_PLACES]
        rows["q"], rows["dq"] = report.q[JOINT_PLACES], report.dq[JOINT_PLACES]
        rows["tau"] = _to_steps(_SCALE["tau"] * report.tau[JOINT_PLACES])
        rows["temperature"] = np.clip(report.temperature[JOINT_PLACES], -128, 127)
        packet["foot"] = _to_steps(report.foot[FOOT_PLACES])
        packet["tick"] = report.tick & 0xFFFFFFFF
        packet["remote"] = np.frombuffer(report.remote, np.uint8)
        if report.battery is not None and "battery" in (self.report.names or ()):
            _write_battery(packet["battery"], report.battery)
        return _seal(packet)

    def decode_report(self, packet: bytes) -> RobotReport:
        """See `PacketCodec`."""
        fields = self._open(packet, self.report, f"report of the {self.name}")
        imu, rows = fields["imu"], fields["motor"][:N_JOINTS]
        battery = fields["battery"] if "battery" in (self.report.names or ()) else None
        return RobotReport(
            tick=int(fields["tick"]),
            quat_wxyz=imu["quaternion"].astype(float),
            gyro=imu["gyro"].astype(float),
            accel=imu["accel"].astype(float),
            q=to_project(rows["q"], JOINT_PLACES),
            dq=to_project(rows["dq"], JOINT_PLACES),
            tau=to_project(rows["tau"], JOINT_PLACES) / _SCALE["tau"],
            foot=to_project(fields["foot"], FOOT_PLACES),
            mode=rows["mode"][JOINT_PLACES],
            temperature=to_project(rows["temperature"], JOINT_PLACES),
            imu_temperature=int(imu["temperature"]),
            remote=fields["remote"].tobytes(),
            battery=None if battery is None else _read_battery(battery),
        )

    def _blank(self, layout: np.dtype[np.void]) -> Any:
        packet = np.zeros((), layout)
        packet["level"] = _LOW_LEVEL
        if "head" in (layout.names or ()):
            packet["head"] = _HEAD
        return packet

    def _open(self, packet: bytes, layout: np.dtype[np.void], what: str) -> Any:
        """The fields of a packet of this layout that is whole.

        Raises:
            PacketError: another length, another head, damaged, or not of the low level.
        """
        check_size(packet, layout.itemsize, what)
        fields = np.frombuffer(packet, layout)[0]
        if "head" in (layout.names or ()) and tuple(fields["head"]) != _HEAD:
            raise PacketError(f"{what}: head", fields["head"].tobytes().hex(), "feef")
        if fields["level"] != _LOW_LEVEL:
            cause = "the robot's own controller is still in charge"
            raise PacketError(f"{what}: level", f"{fields['level']:#x}", f"{_LOW_LEVEL:#x}", cause)
        check_crc(int(fields["crc"]), crc32(packet[: _covered(len(packet))]), what)
        return fields


def _covered(size: int) -> int:
    """Bytes that the check sum covers: all whole words but the last, no rest before it."""
    return (size // 4 - 1) * 4


def _seal(packet: NDArray[np.void]) -> bytes:
    body = packet.tobytes()
    return body[:-4] + crc32(body[: _covered(len(body))]).to_bytes(4, "little")


def _to_steps(values: Array) -> Array:
    """Whole numbers of 16 bits, rounded."""
    rounded: Array = np.clip(np.rint(values), _STEPS.min, _STEPS.max)
    return rounded


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
