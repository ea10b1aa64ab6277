"""Packets of the Go2: `LowCmd_` and `LowState_` as C structs, over which Unitree's check sum runs.

On the wire they are CDR without the structs' padding; the DDS library turns one into the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.unitree.crc import crc32
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    NO_ANGLE,
    NO_RATE,
    ON,
    Battery,
    MotorTargets,
    PacketError,
    RobotReport,
    check_crc,
    check_finite,
    check_size,
    to_project,
)

COMMAND_TOPIC, REPORT_TOPIC = "rt/lowcmd", "rt/lowstate"
COMMAND_TYPE, REPORT_TYPE = "unitree_go::msg::dds_::LowCmd_", "unitree_go::msg::dds_::LowState_"

_MOTORS: Final = 20  # of which the robot has twelve
_HEAD: Final = (0xFE, 0xEF)
_LOW_LEVEL: Final = 0xFF
_INT16: Final = np.iinfo(np.int16)


def _struct(fields: Sequence[tuple[Any, ...]]) -> np.dtype[np.void]:
    """A struct as a C compiler lays it out."""
    return np.dtype(list(fields), align=True)


_START: Final[Sequence[tuple[Any, ...]]] = [
    ("head", "u1", 2), ("level", "u1"), ("frame_reserve", "u1"), ("serial", "u4", 2),
    ("version", "u4", 2), ("bandwidth", "u2"),
]  # fmt: skip
_MOTOR_COMMAND: Final = _struct([
    ("mode", "u1"), ("q", "f4"), ("dq", "f4"), ("tau", "f4"), ("kp", "f4"), ("kd", "f4"),
    ("reserve", "u4", 3),
])  # fmt: skip
_MOTOR_STATE: Final = _struct([
    ("mode", "u1"), ("q", "f4"), ("dq", "f4"), ("ddq", "f4"), ("tau", "f4"), ("q_raw", "f4"),
    ("dq_raw", "f4"), ("ddq_raw", "f4"), ("temperature", "u1"), ("lost", "u4"),
    ("reserve", "u4", 2),
])  # fmt: skip
_IMU: Final = _struct([
    ("quaternion", "f4", 4), ("gyro", "f4", 3), ("accel", "f4", 3), ("rpy", "f4", 3),
    ("temperature", "u1"),
])  # fmt: skip
_BATTERY: Final = _struct([
    ("version_high", "u1"), ("version_low", "u1"), ("status", "u1"), ("charge", "u1"),
    ("current_ma", "i4"), ("cycle", "u2"), ("battery_ntc", "u1", 2), ("board_ntc", "u1", 2),
    ("cells_mv", "u2", 15),
])  # fmt: skip
COMMAND: Final = _struct([
    *_START, ("motor", _MOTOR_COMMAND, _MOTORS), ("battery_off", "u1"),
    ("battery_reserve", "u1", 3), ("remote", "u1", 40), ("led", "u1", 12), ("fan", "u1", 2),
    ("gpio", "u1"), ("reserve", "u4"), ("crc", "u4"),
])  # fmt: skip
REPORT: Final = _struct([
    *_START, ("imu", _IMU), ("motor", _MOTOR_STATE, _MOTORS), ("battery", _BATTERY),
    ("foot", "i2", 4), ("foot_estimate", "i2", 4), ("tick", "u4"), ("remote", "u1", 40),
    ("bit_flag", "u1"), ("adc_reel", "f4"), ("ntc1", "u1"), ("ntc2", "u1"), ("power_v", "f4"),
    ("power_a", "f4"), ("fan_frequency", "u2", 4), ("reserve", "u4"), ("crc", "u4"),
])  # fmt: skip


class Go2Codec:
    """See `PacketCodec`; torques and gains are floats on this wire, so none is cut."""

    def encode_command(self, targets: MotorTargets) -> bytes:
        """See `PacketCodec`."""
        check_finite(targets)
        packet = _blank(COMMAND)
        motors = packet["motor"]
        motors["mode"], motors["q"], motors["dq"] = ON, NO_ANGLE, NO_RATE  # of those it lacks
        rows = motors[:N_JOINTS]
        for name in ("mode", "q", "dq", "tau", "kp", "kd"):
            rows[name] = getattr(targets, name)[JOINT_PLACES]
        return _seal(packet)

    def decode_command(self, packet: bytes) -> MotorTargets:
        """See `PacketCodec`."""
        rows = _open(packet, COMMAND, "command of the Go2")["motor"][:N_JOINTS][JOINT_PLACES]
        numbers = {name: rows[name].astype(float) for name in ("q", "dq", "tau", "kp", "kd")}
        return MotorTargets(rows["mode"].copy(), **numbers)

    def encode_report(self, report: RobotReport) -> bytes:
        """See `PacketCodec`."""
        packet = _blank(REPORT)
        imu, rows = packet["imu"], packet["motor"][:N_JOINTS]
        imu["quaternion"], imu["gyro"], imu["accel"] = report.quat_wxyz, report.gyro, report.accel
        imu["temperature"] = np.clip(report.imu_temperature, 0, 255)
        for name in ("mode", "q", "dq", "tau", "lost"):
            rows[name] = getattr(report, name)[JOINT_PLACES]
        rows["temperature"] = np.clip(report.temperature[JOINT_PLACES], 0, 255)
        packet["foot"] = np.clip(np.rint(report.foot[FOOT_PLACES]), _INT16.min, _INT16.max)
        packet["tick"] = report.tick & 0xFFFFFFFF
        packet["remote"] = np.frombuffer(report.remote, np.uint8)
        if report.battery is not None:
            battery = packet["battery"]
            battery["charge"] = report.battery.charge
            battery["current_ma"] = round(1000.0 * report.battery.current)
            packet["power_v"] = report.battery.voltage or 0.0
        return _seal(packet)

    def decode_report(self, packet: bytes) -> RobotReport:
        """See `PacketCodec`."""
        fields = _open(packet, REPORT, "report of the Go2")
        imu, rows, battery = fields["imu"], fields["motor"][:N_JOINTS], fields["battery"]
        return RobotReport(
            tick=int(fields["tick"]),
            quat_wxyz=imu["quaternion"].astype(float),
            gyro=imu["gyro"].astype(float),
            accel=imu["accel"].astype(float),
            q=to_project(rows["q"], JOINT_PLACES),
            dq=to_project(rows["dq"], JOINT_PLACES),
            tau=to_project(rows["tau"], JOINT_PLACES),
            foot=to_project(fields["foot"], FOOT_PLACES),
            mode=rows["mode"][JOINT_PLACES],
            temperature=to_project(rows["temperature"], JOINT_PLACES),
            lost=rows["lost"][JOINT_PLACES].astype(np.int64),
            imu_temperature=int(imu["temperature"]),
            remote=fields["remote"].tobytes(),
            battery=Battery(
                int(battery["charge"]), 1e-3 * int(battery["current_ma"]), float(fields["power_v"])
            ),
        )


def _blank(layout: np.dtype[np.void]) -> Any:
    packet = np.zeros((), layout)
    packet["head"], packet["level"] = _HEAD, _LOW_LEVEL
    return packet


def _seal(packet: Any) -> bytes:
    packet["crc"] = crc32(packet.tobytes()[:-4])
    sealed: bytes = packet.tobytes()
    return sealed


def _open(packet: bytes, layout: np.dtype[np.void], what: str) -> Any:
    """The fields of a packet of this layout that is whole.

    Raises:
        PacketError: another length or head, damaged, or not of the low level.
    """
    check_size(packet, layout.itemsize, what)
    fields = np.frombuffer(packet, layout)[0]
    if tuple(fields["head"]) != _HEAD:
        raise PacketError(f"{what}: head", fields["head"].tobytes().hex(), "feef")
    if fields["level"] != _LOW_LEVEL:
        raise PacketError(f"{what}: level", f"{fields['level']:#x}", f"{_LOW_LEVEL:#x}")
    check_crc(int(fields["crc"]), crc32(packet[:-4]), what)
    return fields


GO2: Final = Go2Codec()
