"""One packet of a robot in this project's order, units and frames, and what a codec of it is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.robot.conventions import N_JOINTS, N_LEGS, Array

SERVO: Final = 0x0A  # of A1 and Go1: the motor follows its command
ON: Final = 0x01  # the same of the Go2
OFF: Final = 0x00  # the motor brakes, and gives no torque of its own
PROTECTED: Final = 0x08  # the motor has switched itself off: too hot, or too much current
REMOTE_BYTES: Final = 40
_GREATEST: Final = float(np.finfo(np.float32).max)
NO_ANGLE, NO_RATE = 2.146e9, 16000.0  # rad, rad/s: what Unitree writes where nothing is asked for

# Where each of this project's joints and feet (FL FR RL RR) is in the robots' order (FR FL RR RL).
# Both are their own inverse.
JOINT_PLACES: Final = np.array([3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8])
FOOT_PLACES: Final = np.array([1, 0, 3, 2])


class PacketError(QuadrigaError):
    """Bytes are not a packet of this robot, or a command holds what no packet can carry."""

    @property
    def reason(self) -> str:
        """What is wrong, in a word: the size or the crc of a packet, or a field of a command."""
        return self.name.rpartition(": ")[2]


@dataclass(frozen=True, slots=True)
class Battery:
    """What a robot says of its battery.

    Attributes:
        charge: 0 … 100 %.
        current: out of the battery negative, A.
        voltage: V; None of a robot that does not tell it.
    """

    charge: int
    current: float
    voltage: float | None = None


@dataclass(frozen=True, slots=True)
class MotorTargets:
    """What the twelve motors are to do: τ = tau + kp (q − q_measured) + kd (dq − dq_measured).

    Attributes:
        mode: of each motor, (12,): `SERVO`, `ON` or `OFF`.
        q: rad, (12,), joints in this project's order, as all others.
        dq: rad/s.
        tau: N·m.
        kp: N·m/rad.
        kd: N·m·s/rad.
    """

    mode: NDArray[np.uint8]
    q: Array
    dq: Array
    tau: Array
    kp: Array
    kd: Array


@dataclass(frozen=True, slots=True)
class RobotReport:
    """What a robot measures and says of itself in one packet.

    Attributes:
        tick: the robot's own counter; its unit and where it begins are not known.
        quat_wxyz: attitude, trunk to world, (4,).
        gyro: rad/s, trunk frame, (3,).
        accel: specific force, m/s², trunk frame, at the IMU, (3,).
        q, dq, tau: of the joints in this project's order, (12,), rad, rad/s, N·m.
        foot: raw counts of the feet's sensors in this project's order, (4,).
        mode: of each motor, (12,).
        temperature: of each motor, (12,), °C.
        lost: packets that each motor has missed, (12,); zeros of a robot that does not count them.
        imu_temperature: °C.
        remote: of the remote control, 40 bytes, see `remote.read_remote`.
        battery: None of a robot that says nothing of it.
    """

    tick: int
    quat_wxyz: Array
    gyro: Array
    accel: Array
    q: Array
    dq: Array
    tau: Array
    foot: Array = field(default_factory=lambda: np.zeros(N_LEGS))
    mode: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(N_JOINTS, dtype=np.uint8))
    temperature: Array = field(default_factory=lambda: np.zeros(N_JOINTS))
    lost: NDArray[np.int64] = field(default_factory=lambda: np.zeros(N_JOINTS, dtype=np.int64))
    imu_temperature: int = 0
    remote: bytes = bytes(REMOTE_BYTES)
    battery: Battery | None = None


class PacketCodec(Protocol):
    """Turns packets of one kind of robot into bytes and back; the robot's side and ours."""

    def encode_command(self, targets: MotorTargets) -> bytes:
        """The bytes that a robot obeys.

        Torques and gains beyond what a packet holds are brought to its limits.

        Raises:
            PacketError: a number is not finite.
        """
        ...

    def decode_command(self, packet: bytes) -> MotorTargets:
        """What a command asks of the motors, with the resolution of the packet.

        Raises:
            PacketError: the bytes are no command, or damaged.
        """
        ...

    def encode_report(self, report: RobotReport) -> bytes:
        """The bytes that a robot sends."""
        ...

    def decode_report(self, packet: bytes) -> RobotReport:
        """What a robot has sent. Numbers may be of any value, also none.

        Raises:
            PacketError: the bytes are no report, or damaged.
        """
        ...


def check_finite(targets: MotorTargets) -> None:
    """Refuse a command with a number that is none.

    Raises:
        PacketError: it names the first such field.
    """
    t = targets
    # This way round, no number is refused, too.
    if (np.abs(np.concatenate((t.q, t.dq, t.tau, t.kp, t.kd))) <= _GREATEST).all():
        return
    for name in ("q", "dq", "tau", "kp", "kd"):
        values = getattr(targets, name)
        if not (np.abs(values) <= _GREATEST).all():
            raise PacketError(f"motor command: {name}", f"{values}", "finite numbers of 32 bits")


def check_size(packet: bytes, size: int, what: str) -> None:
    """Refuse a packet of another length.

    Raises:
        PacketError: it is shorter or longer.
    """
    if len(packet) != size:
        got = f"{len(packet)} bytes"
        raise PacketError(f"{what}: size", got, f"{size}", "another robot or firmware?")


def check_crc(got: int, computed: int, what: str, level: int) -> None:
    """Refuse a packet with a check sum that is not its own.

    Robots and other people's programs fill in the head and the level of a packet as they like: a
    Go2 leaves the level 0. So these decide nothing.

    Raises:
        PacketError: they differ.
    """
    if got != computed:
        cause = f"damaged on its way? its level is {level:#04x}"
        raise PacketError(f"{what}: crc", f"{got:08x}", f"{computed:08x}", cause)
