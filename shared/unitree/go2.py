"""Packets of the Go2: `LowCmd_` and `LowState_` as C structs, over which Unitree's check sum runs.

On the wire they are CDR without the structs' padding; the DDS library turns one into the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from quadriga.shared.unitree.crc import crc32
from quadriga.shared.unitree.fields import Fields, Raw
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    NO_ANGLE,
    NO_RATE,
    ON,
    Battery,
    MotorTargets,
    RobotReport,
    check_crc,
    check_finite,
    check_size,
)

COMMAND_TOPIC, REPORT_TOPIC = "rt/lowcmd", "rt/lowstate"
COMMAND_TYPE, REPORT_TYPE = "unitree_go::msg::dds_::LowCmd_", "unitree_go::msg::dds_::LowState_"

_MOTORS: Final = 20  # of which the robot has twelve
_HEAD: Final = b"\xfe\xef"
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
    ("dq_raw", "f4"), ("ddq_raw", "f4"), ("temperature", "i1"), ("lost", "u4"),
    ("reserve", "u4", 2),
])  # fmt: skip
_IMU: Final = _struct([
    ("quaternion", "f4", 4), ("gyro", "f4", 3), ("accel", "f4", 3), ("rpy", "f4", 3),
    ("temperature", "i1"),
])  # fmt: skip
_BATTERY: Final = _struct([
    ("version_high", "u1"), ("version_low", "u1"), ("status", "u1"), ("charge", "u1"),
    ("current_ma", "i4"), ("cycle", "u2"), ("battery_ntc", "i1", 2), ("board_ntc", "i1", 2),
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
    ("bit_flag", "u1"), ("adc_reel", "f4"), ("ntc1", "i1"), ("ntc2", "i1"), ("power_v", "f4"),
    ("power_a", "f4"), ("fan_frequency", "u2", 4), ("reserve", "u4"), ("crc", "u4"),
])  # fmt: skip


class Go2Codec:
    """See `PacketCodec`; torques and gains are floats on this wire, so none is cut."""

    def __init__(self) -> None:
        joints = JOINT_PLACES
        self._asked_floats = Fields(
            COMMAND,
            motor__q=joints,
            motor__dq=joints,
            motor__tau=joints,
            motor__kp=joints,
            motor__kd=joints,
        )
        self._asked_modes = Fields(COMMAND, motor__mode=joints)
        self._floats = Fields(
            REPORT,
            imu__quaternion=None,
            imu__gyro=None,
            imu__accel=None,
            motor__q=joints,
            motor__dq=joints,
            motor__tau=joints,
        )
        self._feet, self._lost = (
            Fields(REPORT, foot=FOOT_PLACES),
            Fields(REPORT, motor__lost=joints),
        )
        self._modes = Fields(REPORT, motor__mode=joints)
        self._temperatures = Fields(REPORT, motor__temperature=joints, imu__temperature=None)
        self._blank_command, self._blank_report = _blank(COMMAND), _blank(REPORT)
        self._blank_command["level"] = _LOW_LEVEL  # which the robot leaves 0 in its reports
        motors = self._blank_command["motor"]
        motors["mode"], motors["q"], motors["dq"] = ON, NO_ANGLE, NO_RATE  # of those it lacks

    def encode_command(self, targets: MotorTargets) -> bytes:
        """See `PacketCodec`."""
        check_finite(targets)
        raw = np.frombuffer(self._blank_command.tobytes(), np.uint8).copy()
        t = targets
        self._asked_modes.write(raw, (t.mode,))
        self._asked_floats.write(raw, (t.q, t.dq, t.tau, t.kp, t.kd))
        return _seal(raw)

    def decode_command(self, packet: bytes) -> MotorTargets:
        """See `PacketCodec`."""
        raw = _open(packet, COMMAND, "command of the Go2")
        (mode,) = self._asked_modes.read(raw, np.uint8)
        return MotorTargets(mode, *self._asked_floats.read(raw, float))

    def encode_report(self, report: RobotReport) -> bytes:
        """See `PacketCodec`."""
        raw = np.frombuffer(self._blank_report.tobytes(), np.uint8).copy()
        r = report
        self._floats.write(raw, (r.quat_wxyz, r.gyro, r.accel, r.q, r.dq, r.tau))
        self._feet.write(raw, (np.clip(np.rint(r.foot), _INT16.min, _INT16.max),))
        self._lost.write(raw, (r.lost,))
        self._modes.write(raw, (r.mode,))
        degrees = np.clip((*r.temperature, r.imu_temperature), -128, 127)
        self._temperatures.write(raw, (degrees,))
        fields = raw.view(REPORT)[0]
        fields["tick"] = report.tick & 0xFFFFFFFF
        fields["remote"] = np.frombuffer(report.remote, np.uint8)
        if report.battery is not None:
            battery = fields["battery"]
            battery["charge"] = report.battery.charge
            battery["current_ma"] = round(1000.0 * report.battery.current)
            fields["power_v"] = report.battery.voltage or 0.0
        return _seal(raw)

    def decode_report(self, packet: bytes) -> RobotReport:
        """See `PacketCodec`."""
        raw = _open(packet, REPORT, "report of the Go2")
        quat, gyro, accel, q, dq, tau = self._floats.read(raw, float)
        (foot,), (lost,) = self._feet.read(raw, float), self._lost.read(raw, np.int64)
        (mode,) = self._modes.read(raw, np.uint8)
        temperature, imu_temperature = self._temperatures.read(raw, float)
        fields = raw.view(REPORT)[0]
        battery = fields["battery"]
        return RobotReport(
            tick=int(fields["tick"]),
            quat_wxyz=quat,
            gyro=gyro,
            accel=accel,
            q=q,
            dq=dq,
            tau=tau,
            foot=foot,
            mode=mode,
            temperature=temperature,
            lost=lost,
            imu_temperature=int(imu_temperature[0]),
            remote=fields["remote"].tobytes(),
            battery=Battery(
                int(battery["charge"]), 1e-3 * int(battery["current_ma"]), float(fields["power_v"])
            ),
        )


def _blank(layout: np.dtype[np.void]) -> Any:
    packet = np.zeros((), layout)
    packet["head"] = tuple(_HEAD)
    return packet


def _seal(packet: Raw) -> bytes:
    body = packet.tobytes()[:-4]
    return body + crc32(body).to_bytes(4, "little")


def _open(packet: bytes, layout: np.dtype[np.void], what: str) -> Raw:
    """The bytes of a packet of this layout that is whole.

    Raises:
        PacketError: another length, or damaged.
    """
    check_size(packet, layout.itemsize, what)
    check_crc(int.from_bytes(packet[-4:], "little"), crc32(packet[:-4]), what, packet[2])
    return np.frombuffer(packet, np.uint8)


GO2: Final = Go2Codec()
