"""Packets of the A1 and the Go1 over UDP and of the Go2 over DDS, as bytes.

A1 and Go1: the layouts were read off packets that Unitree's own libraries sent and took. They are
not the structs of Unitree's headers: the library packs torques and gains into 16 bits. Go2:
`LowCmd_` and `LowState_` as C structs, over which Unitree's check sum runs; on the wire they are
CDR without the structs' padding, and the DDS library turns one into the other.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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

Raw = NDArray[np.uint8]
_Fields = Sequence[tuple[Any, ...]]

_MOTORS: Final = 20  # of which the robots have twelve
_LOW_LEVEL: Final = 0xFF
_HEAD: Final = b"\xfe\xef"
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


class Fields:
    """Numbers of one type that lie scattered over a packet, read and written at once.

    numpy takes a microsecond for each field of a struct, and a packet has dozens. The bytes of all
    numbers of a type are gathered instead, by places that are worked out once.

    Args:
        layout: of the packet.
        members: what to read, each by its path, such as `motor__q`, with the order in which its
            numbers are wanted: places in the packet's own order. None: as they are.

    Raises:
        ValueError: they are not of one type.
    """

    def __init__(self, layout: np.dtype[Any], **members: NDArray[np.int64] | None) -> None:
        parts, kinds = list[NDArray[np.int64]](), set[np.dtype[Any]]()
        for path, order in members.items():
            places, kind = _places(layout, path.split("__"))
            kinds.add(kind)
            places = places if order is None else places[order]
            parts.append((places[:, None] + np.arange(kind.itemsize)).ravel())
        if len(kinds) != 1:
            raise ValueError(f"{', '.join(members)}: of several types")
        self.kind = kinds.pop()
        self._places = np.concatenate(parts)
        ends = np.cumsum([0, *(len(part) // self.kind.itemsize for part in parts)]).tolist()
        self._cuts = [slice(*ends_of) for ends_of in pairwise(ends)]

    def read(self, raw: Raw, kind: type[Any]) -> list[NDArray[Any]]:
        """The numbers of each member, as another type.

        Args:
            raw: the packet's bytes.
            kind: of the numbers that are given.
        """
        numbers = raw[self._places].view(self.kind).astype(kind)
        return [numbers[cut] for cut in self._cuts]

    def write(self, raw: Raw, *values: NDArray[Any]) -> None:
        """Put numbers of each member into a packet; they must fit."""
        numbers = np.concatenate(values).astype(self.kind)
        raw[self._places] = numbers.view(np.uint8)


def _places(layout: np.dtype[Any], path: Sequence[str]) -> tuple[NDArray[np.int64], np.dtype[Any]]:
    """Where the numbers of a member begin in a packet, and their type."""
    begins, kind = np.zeros(1, dtype=np.int64), layout
    for name in path:
        if kind.fields is None:
            raise ValueError(f"{name}: not a struct")
        kind, offset = kind.fields[name][:2]
        begins = begins + offset
        if kind.subdtype is not None:
            kind, shape = kind.subdtype
            within = kind.itemsize * np.arange(int(np.prod(shape)))
            begins = (begins[:, None] + within).ravel()
    return begins, kind


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
        scale: Mapping[str, float] | None = None,
    ) -> None:
        self.command, self.report, self.servo = command, report, servo
        self._name, joints = name, JOINT_PLACES
        scale = scale or {"tau": 1.0, "kp": 1.0, "kd": 1.0}
        self._tau_scale = scale["tau"]
        self._scales = np.repeat([scale["tau"], scale["kp"], scale["kd"]], N_JOINTS)
        self._angles = Fields(command, motor__q=joints, motor__dq=joints)
        self._efforts = Fields(command, motor__tau=joints, motor__kp=joints, motor__kd=joints)
        self._asked_modes = Fields(command, motor__mode=joints)
        self._floats = Fields(
            report,
            imu__quaternion=None,
            imu__gyro=None,
            imu__accel=None,
            motor__q=joints,
            motor__dq=joints,
        )
        self._torques = Fields(report, motor__tau=joints)
        self._feet = Fields(report, foot=FOOT_PLACES)
        self._modes = Fields(report, motor__mode=joints)
        self._temperatures = Fields(report, motor__temperature=joints, imu__temperature=None)
        counts_lost = "lost" in (report["motor"].base.names or ())
        self._lost = Fields(report, motor__lost=joints) if counts_lost else None
        self._blank_command, self._blank_report = self._blank(command), self._blank(report)
        self._blank_command["level"] = _LOW_LEVEL
        motors = self._blank_command["motor"]
        motors["mode"], motors["q"], motors["dq"] = servo, NO_ANGLE, NO_RATE  # of those it lacks
        if not self._tells_power:  # a Go2 leaves the level of its reports 0
            self._blank_report["level"] = _LOW_LEVEL

    def encode_command(self, targets: MotorTargets) -> bytes:
        """The bytes that a robot obeys.

        Torques and gains of 16 bits are cut towards zero, as Unitree's library does, and brought
        to the limits of the packet.

        Raises:
            PacketError: a number is not finite.
        """
        t = targets
        # This way round, no number is refused, too.
        if not (np.abs(np.concatenate((t.q, t.dq, t.tau, t.kp, t.kd))) <= _GREATEST).all():
            for name in ("q", "dq", "tau", "kp", "kd"):
                if not (np.abs(values := getattr(t, name)) <= _GREATEST).all():
                    expected = "finite numbers of 32 bits"
                    raise PacketError(f"motor command: {name}", f"{values}", expected)
        raw = np.frombuffer(self._blank_command.tobytes(), np.uint8).copy()
        self._asked_modes.write(raw, t.mode)
        self._angles.write(raw, t.q, t.dq)
        efforts = self._scales * np.concatenate((t.tau, t.kp, t.kd))
        if self._efforts.kind.kind == "i":
            efforts = np.trunc(np.clip(efforts, _STEPS.min, _STEPS.max))
        self._efforts.write(raw, efforts)
        return seal(raw.tobytes())

    def decode_command(self, packet: bytes) -> MotorTargets:
        """What a command asks of the motors, with the resolution of the packet.

        Raises:
            PacketError: the bytes are no command, or damaged.
        """
        raw = self._open(packet, self.command, "command")
        (mode,) = self._asked_modes.read(raw, np.uint8)
        q, dq = self._angles.read(raw, float)
        efforts = np.concatenate(self._efforts.read(raw, float)) / self._scales
        return MotorTargets(mode, q, dq, *efforts.reshape(3, N_JOINTS))

    def encode_report(self, report: RobotReport) -> bytes:
        """The bytes that a robot sends."""
        raw = np.frombuffer(self._blank_report.tobytes(), np.uint8).copy()
        r, tau = report, self._tau_scale * report.tau
        self._floats.write(raw, r.quat_wxyz, r.gyro, r.accel, r.q, r.dq)
        if self._torques.kind.kind == "i":
            tau = np.clip(np.rint(tau), _STEPS.min, _STEPS.max)
        self._torques.write(raw, tau)
        self._feet.write(raw, np.clip(np.rint(r.foot), _STEPS.min, _STEPS.max))
        self._modes.write(raw, r.mode)
        self._temperatures.write(raw, np.clip((*r.temperature, r.imu_temperature), -128, 127))
        if self._lost is not None:
            self._lost.write(raw, r.lost)
        fields = raw.view(self.report)[0]
        fields["tick"] = r.tick & 0xFFFFFFFF
        fields["remote"] = np.frombuffer(r.remote, np.uint8)
        if r.battery is not None and self._has_battery:
            self._write_battery(fields, r.battery)
        return seal(raw.tobytes())

    def decode_report(self, packet: bytes) -> RobotReport:
        """What a robot has sent. Numbers may be of any value, also none.

        Raises:
            PacketError: the bytes are no report, or damaged.
        """
        raw = self._open(packet, self.report, "report")
        quat, gyro, accel, q, dq = self._floats.read(raw, float)
        (tau,), (foot,) = self._torques.read(raw, float), self._feet.read(raw, float)
        (mode,) = self._modes.read(raw, np.uint8)
        temperature, imu_temperature = self._temperatures.read(raw, float)
        lost = np.zeros(N_JOINTS, np.int64)
        if self._lost is not None:
            (lost,) = self._lost.read(raw, np.int64)
        fields = raw.view(self.report)[0]
        return RobotReport(
            tick=int(fields["tick"]),
            quat_wxyz=quat,
            gyro=gyro,
            accel=accel,
            q=q,
            dq=dq,
            tau=tau / self._tau_scale,
            foot=foot,
            mode=mode,
            temperature=temperature,
            lost=lost,
            imu_temperature=int(imu_temperature[0]),
            remote=fields["remote"].tobytes(),
            battery=self._read_battery(fields) if self._has_battery else None,
        )

    @property
    def _has_battery(self) -> bool:
        return "battery" in (self.report.names or ())

    @property
    def _tells_power(self) -> bool:
        """Whether the voltage is a field, and not the sum of the cells'."""
        return "power_v" in (self.report.names or ())

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

    @staticmethod
    def _blank(layout: np.dtype[np.void]) -> Any:
        packet = np.zeros((), layout)
        if "head" in (layout.names or ()):
            packet["head"] = tuple(_HEAD)
        return packet

    def _open(self, packet: bytes, layout: np.dtype[np.void], what: str) -> Raw:
        """The bytes of a packet of this layout that is whole.

        Robots and other people's programs fill in the head and the level of a packet as they like:
        a Go2 leaves the level 0. So these decide nothing.

        Raises:
            PacketError: another length, or damaged.
        """
        what = f"{what} of the {self._name}"
        if len(packet) != layout.itemsize:
            got, expected = f"{len(packet)} bytes", str(layout.itemsize)
            raise PacketError(f"{what}: size", got, expected, "another robot or firmware?")
        if (right := seal(packet)) != packet:
            got, expected = (f"{int.from_bytes(p[-4:], 'little'):08x}" for p in (packet, right))
            level = packet[2 if "head" in (layout.names or ()) else 0]
            cause = f"damaged on its way? its level is {level:#04x}"
            raise PacketError(f"{what}: crc", got, expected, cause)
        return np.frombuffer(packet, np.uint8)


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
_UDP_SCALE: Final = {"tau": 256.0, "kp": 32.0, "kd": 16.0}

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
