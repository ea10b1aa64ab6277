"""Packets of the A1 and the Go1 over UDP and of the Go2 over DDS, as bytes.

A1 and Go1: the layouts were read off packets that Unitree's own libraries sent and took. They are
not the structs of Unitree's headers: the library packs torques and gains into 16 bits. Go2:
`LowCmd_` and `LowState_` as C structs, over which Unitree's check sum runs; on the wire they are
CDR without the structs' padding, and the DDS library turns one into the other.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    NO_ANGLE,
    NO_RATE,
    ON,
    SERVO,
    Battery,
    MotorTargets,
    PacketError,
    RobotReport,
)

_Fields = Sequence[tuple[Any, ...]]

_MOTORS: Final = 20  # of which the robots have twelve
_LOW_LEVEL: Final = 0xFF
_HEAD: Final = (0xFE, 0xEF)
_COMMANDED: Final = ("q", "dq", "tau", "kp", "kd")
_STEPS: Final = np.iinfo(np.int16)
_GREATEST: Final = float(np.finfo(np.float32).max)
_CELLS: Final = 10
_CELL_V: Final = 0.032
_MIRRORED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_ALL_ONES: Final = 0xFFFFFFFF


def crc32(packet: bytes) -> int:
    """The check sum of the whole words of a packet; up to three bytes at its end do not count.

    CRC-32/MPEG-2 over little-endian words of four bytes: polynomial 0x04C11DB7, first 0xFFFFFFFF,
    neither reflected nor inverted at the end; each word counts with its most significant byte
    first. zlib's CRC is the same with all bits mirrored.
    """
    words = len(packet) // 4
    swapped = np.frombuffer(packet, ">u4", words).astype("<u4").tobytes()
    mirrored = zlib.crc32(swapped.translate(_MIRRORED)) ^ _ALL_ONES
    return int.from_bytes(mirrored.to_bytes(4, "little").translate(_MIRRORED), "big")


def seal(packet: bytes) -> bytes:
    """The packet with the check sum that belongs to it.

    It covers all whole words but the last, and no rest before that.
    """
    covered = (len(packet) // 4 - 1) * 4
    return packet[:-4] + crc32(packet[:covered]).to_bytes(4, "little")


class Codec:
    """Turns packets of one kind of robot into bytes and back; the robot's side and ours.

    Args:
        name: of the robot, for errors.
        command: layout of a command.
        report: layout of what the robot sends.
        servo: a motor's mode in which it follows commands.
        scale: steps per unit of tau, kp and kd, where 16 bits hold them.

    Attributes:
        command, report, servo: as given.
    """

    def __init__(
        self,
        name: str,
        command: np.dtype[np.void],
        report: np.dtype[np.void],
        servo: int,
        scale: tuple[float, float, float] | None = None,
    ) -> None:
        self.command, self.report, self.servo = command, report, servo
        self._name, self._in_steps = name, scale is not None
        self._scale = np.array(scale or (1.0, 1.0, 1.0))[:, None]
        names = report.names or ()
        self._has_battery = "battery" in names
        self._tells_power = "power_v" in names  # as a field, and not as the sum of the cells'
        self._counts_lost = "lost" in (report["motor"].base.names or ())
        asked, told = np.zeros(1, command), np.zeros(1, report)
        for blank in (asked, told):
            if "head" in names:
                blank["head"] = _HEAD
            blank["level"] = _LOW_LEVEL
        if self._tells_power:  # a Go2 leaves the level of its reports 0
            told["level"] = 0
        motors = asked["motor"]
        motors["mode"], motors["q"], motors["dq"] = servo, NO_ANGLE, NO_RATE  # of those it lacks
        self._blank_command, self._blank_report = asked.tobytes(), told.tobytes()

    def encode_command(self, targets: MotorTargets) -> bytes:
        """The bytes that a robot obeys.

        Torques and gains of 16 bits are cut towards zero, as Unitree's library does, and brought
        to the limits of the packet.

        Raises:
            PacketError: a number is not finite.
        """
        t = targets
        numbers = np.stack((t.q, t.dq, t.tau, t.kp, t.kd))
        wrong = ~(np.abs(numbers) <= _GREATEST).all(axis=1)  # this way round, no number is, too
        if wrong.any():
            k = int(wrong.argmax())
            expected = "finite numbers of 32 bits"
            raise PacketError(f"motor command: {_COMMANDED[k]}", f"{numbers[k]}", expected)
        if self._in_steps:
            numbers[2:] = np.trunc(np.clip(self._scale * numbers[2:], _STEPS.min, _STEPS.max))
        packet = np.frombuffer(bytearray(self._blank_command), self.command)
        motors = packet[0]["motor"]
        motors["mode"][JOINT_PLACES] = t.mode
        for name, values in zip(_COMMANDED, numbers, strict=True):
            motors[name][JOINT_PLACES] = values
        return seal(packet.tobytes())

    def decode_command(self, packet: bytes) -> MotorTargets:
        """What a command asks of the motors, with the resolution of the packet.

        Raises:
            PacketError: the bytes are no command, or damaged.
        """
        motors = self._open(packet, self.command, "command")["motor"][JOINT_PLACES]
        numbers = np.stack([motors[name] for name in _COMMANDED], dtype=float)
        numbers[2:] /= self._scale
        return MotorTargets(motors["mode"], *numbers)

    def encode_report(self, report: RobotReport) -> bytes:
        """The bytes that a robot sends."""
        packet = np.frombuffer(bytearray(self._blank_report), self.report)
        r, tau, fields = report, report.tau, packet[0]
        imu, motors = fields["imu"], fields["motor"]
        imu["quaternion"], imu["gyro"], imu["accel"] = r.quat_wxyz, r.gyro, r.accel
        imu["temperature"] = min(127, max(-128, r.imu_temperature))
        if self._in_steps:
            tau = np.clip(np.rint(self._scale[0] * tau), _STEPS.min, _STEPS.max)
        values = {"mode": r.mode, "q": r.q, "dq": r.dq, "tau": tau}
        values["temperature"] = np.clip(r.temperature, -128, 127)
        if self._counts_lost:
            values["lost"] = r.lost
        for name, numbers in values.items():
            motors[name][JOINT_PLACES] = numbers
        fields["foot"] = np.clip(np.rint(r.foot), _STEPS.min, _STEPS.max)[FOOT_PLACES]
        fields["tick"] = r.tick & 0xFFFFFFFF
        fields["remote"] = np.frombuffer(r.remote, np.uint8)
        if r.battery is not None and self._has_battery:
            self._write_battery(fields, r.battery)
        return seal(packet.tobytes())

    def decode_report(self, packet: bytes) -> RobotReport:
        """What a robot has sent. Numbers may be of any value, also none.

        Raises:
            PacketError: the bytes are no report, or damaged.
        """
        fields = self._open(packet, self.report, "report")
        imu, motors = fields["imu"], fields["motor"][JOINT_PLACES]
        return RobotReport(
            tick=int(fields["tick"]),
            quat_wxyz=imu["quaternion"].astype(float),
            gyro=imu["gyro"].astype(float),
            accel=imu["accel"].astype(float),
            q=motors["q"].astype(float),
            dq=motors["dq"].astype(float),
            tau=motors["tau"].astype(float) / self._scale[0],
            foot=fields["foot"][FOOT_PLACES].astype(float),
            mode=motors["mode"],
            temperature=motors["temperature"].astype(float),
            lost=motors["lost"].astype(np.int64) if self._counts_lost else np.zeros(N_JOINTS, int),
            imu_temperature=int(imu["temperature"]),
            remote=fields["remote"].tobytes(),
            battery=self._read_battery(fields) if self._has_battery else None,
        )

    def _write_battery(self, fields: Any, battery: Battery) -> None:
        cells = fields["battery"]
        cells["charge"], cells["current_ma"] = battery.charge, round(1000.0 * battery.current)
        if self._tells_power:
            fields["power_v"] = battery.voltage or 0.0
        elif battery.voltage is not None:
            cells["cells"] = min(255, round(battery.voltage / (_CELLS * _CELL_V)))

    def _read_battery(self, fields: Any) -> Battery:
        cells = fields["battery"]
        voltage = fields["power_v"] if self._tells_power else _CELL_V * float(cells["cells"].sum())
        return Battery(int(cells["charge"]), 1e-3 * int(cells["current_ma"]), float(voltage))

    def _open(self, packet: bytes, layout: np.dtype[np.void], what: str) -> Any:
        """A packet of this layout that is whole.

        Robots and other people's programs fill in the head and the level of a packet as they like:
        a Go2 leaves the level 0. So these decide nothing.

        Raises:
            PacketError: another length, or damaged.
        """
        what = f"{what} of the {self._name}"
        if len(packet) != layout.itemsize:
            got, expected = f"{len(packet)} bytes", str(layout.itemsize)
            raise PacketError(f"{what}: size", got, expected, "another robot or firmware?")
        fields = np.frombuffer(packet, layout)[0]
        if (right := seal(packet)) != packet:
            got, expected = (f"{int.from_bytes(p[-4:], 'little'):08x}" for p in (packet, right))
            cause = f"damaged on its way? its level is {int(fields['level']):#04x}"
            raise PacketError(f"{what}: crc", got, expected, cause)
        return fields


def _struct(fields: _Fields) -> np.dtype[np.void]:
    """A struct as a C compiler lays it out."""
    return np.dtype(list(fields), align=True)


_IMU: Final[_Fields] = [
    ("quaternion", "<f4", 4), ("gyro", "<f4", 3), ("accel", "<f4", 3), ("rpy", "<f4", 3),
    ("temperature", "i1"),
]  # fmt: skip
_BATTERY: Final[_Fields] = [
    ("version_high", "u1"), ("version_low", "u1"), ("status", "u1"), ("charge", "u1"),
    ("current_ma", "<i4"), ("cycle", "<u2"), ("battery_ntc", "i1", 2), ("board_ntc", "i1", 2),
]  # fmt: skip
_A1_HEAD: Final[_Fields] = [
    ("level", "u1"), ("version", "<u2"), ("robot_id", "<u2"), ("serial", "<u4"),
    ("bandwidth", "u1"),
]  # fmt: skip
_HEAD_FIELDS: Final[_Fields] = [  # of Go1 and Go2
    ("head", "u1", 2), ("level", "u1"), ("frame_reserve", "u1"), ("serial", "<u4", 2),
    ("version", "<u4", 2), ("bandwidth", "<u2"),
]  # fmt: skip
_FEET: Final[_Fields] = [("foot", "<i2", 4), ("foot_estimate", "<i2", 4), ("tick", "<u4")]
_END: Final[_Fields] = [("remote", "u1", 40), ("reserve", "<u4"), ("crc", "<u4")]

_UDP_MOTOR_COMMAND: Final = np.dtype([
    ("mode", "u1"), ("q", "<f4"), ("dq", "<f4"), ("tau", "<i2"), ("kp", "<i2"), ("kd", "<i2"),
    ("reserve", "<u4", 3),
])  # fmt: skip
_UDP_MOTOR_STATE: Final = np.dtype([
    ("mode", "u1"), ("q", "<f4"), ("dq", "<f4"), ("ddq", "<i2"), ("tau", "<i2"), ("q_raw", "<f4"),
    ("dq_raw", "<f4"), ("ddq_raw", "<i2"), ("temperature", "i1"), ("reserve", "<u4", 2),
])  # fmt: skip
_UDP_STATE: Final[_Fields] = [("imu", list(_IMU)), ("motor", _UDP_MOTOR_STATE, _MOTORS)]
_UDP_SCALE: Final = (256.0, 32.0, 16.0)  # of tau, kp, kd

_GO2_MOTOR_COMMAND: Final = _struct([
    ("mode", "u1"), ("q", "f4"), ("dq", "f4"), ("tau", "f4"), ("kp", "f4"), ("kd", "f4"),
    ("reserve", "u4", 3),
])  # fmt: skip
_GO2_MOTOR_STATE: Final = _struct([
    ("mode", "u1"), ("q", "f4"), ("dq", "f4"), ("ddq", "f4"), ("tau", "f4"), ("q_raw", "f4"),
    ("dq_raw", "f4"), ("ddq_raw", "f4"), ("temperature", "i1"), ("lost", "u4"),
    ("reserve", "u4", 2),
])  # fmt: skip

A1: Final = Codec(
    "A1",
    np.dtype([*_A1_HEAD, ("motor", _UDP_MOTOR_COMMAND, _MOTORS), ("led", "u1", (4, 3)), *_END]),
    np.dtype([*_A1_HEAD, *_UDP_STATE, *_FEET, *_END]),
    SERVO,
    _UDP_SCALE,
)
GO1: Final = Codec(
    "Go1",
    np.dtype([*_HEAD_FIELDS, ("motor", _UDP_MOTOR_COMMAND, _MOTORS), ("battery", "u1", 4), *_END]),
    np.dtype([
        *_HEAD_FIELDS, *_UDP_STATE, ("battery", [*_BATTERY, ("cells", "u1", _CELLS)]), *_FEET,
        *_END,
    ]),
    SERVO,
    _UDP_SCALE,
)  # fmt: skip
GO2: Final = Codec(
    "Go2",
    _struct([
        *_HEAD_FIELDS, ("motor", _GO2_MOTOR_COMMAND, _MOTORS), ("battery_off", "u1"),
        ("battery_reserve", "u1", 3), ("remote", "u1", 40), ("led", "u1", 12), ("fan", "u1", 2),
        ("gpio", "u1"), ("reserve", "u4"), ("crc", "u4"),
    ]),
    _struct([
        *_HEAD_FIELDS, ("imu", _struct(_IMU)), ("motor", _GO2_MOTOR_STATE, _MOTORS),
        ("battery", _struct([*_BATTERY, ("cells_mv", "u2", 15)])), *_FEET, ("remote", "u1", 40),
        ("bit_flag", "u1"), ("adc_reel", "f4"), ("ntc1", "i1"), ("ntc2", "i1"), ("power_v", "f4"),
        ("power_a", "f4"), ("fan_frequency", "u2", 4), ("reserve", "u4"), ("crc", "u4"),
    ]),
    ON,
)  # fmt: skip
CODECS: Final = {"a1": A1, "go1": GO1, "go2": GO2}  # by the kind of robot
