"""What is in the packets of a robot, in this project's order, units and frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.robots.conventions import N_JOINTS, N_LEGS, Array

SERVO: Final = 0x0A  # of A1 and Go1: the motor follows its command
ON: Final = 0x01  # the same of the Go2
OFF: Final = 0x00  # the motor brakes, and gives no torque of its own
PROTECTED: Final = 0x08  # the motor has switched itself off: too hot, or too much current
_STOP: Final = 1 << 5 | 1 << 9  # bits of L2 and B
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
    """What a robot says of its battery."""

    charge: int  # 0 … 100 %
    current: float  # out of the battery negative, A
    voltage: float | None = None  # V; None of a robot that does not tell it


@dataclass(frozen=True, slots=True)
class MotorTargets:
    """What the twelve motors are to do: τ = tau + kp (q − q_measured) + kd (dq − dq_measured)."""

    mode: NDArray[np.uint8]  # of each motor, (12,): `SERVO`, `ON` or `OFF`
    q: Array  # rad, (12,), joints in this project's order, as all others
    dq: Array  # rad/s
    tau: Array  # N·m
    kp: Array  # N·m/rad
    kd: Array  # N·m·s/rad


@dataclass(frozen=True, slots=True)
class RobotReport:
    """What a robot measures and says of itself in one packet; legs in this project's order."""

    tick: int  # the robot's own counter; its unit and where it begins are not known
    quat_wxyz: Array  # attitude, trunk to world, (4,)
    gyro: Array  # rad/s, trunk frame, (3,)
    accel: Array  # specific force, m/s², trunk frame, at the IMU, (3,)
    q: Array  # of the joints, as all that follow, (12,), rad
    dq: Array  # rad/s
    tau: Array  # N·m
    foot: Array = field(default_factory=lambda: np.zeros(N_LEGS))  # raw counts of the sensors, (4,)
    mode: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(N_JOINTS, dtype=np.uint8))
    temperature: Array = field(default_factory=lambda: np.zeros(N_JOINTS))  # °C
    # Packets that each motor has missed; zeros of a robot that does not count them.
    lost: NDArray[np.int64] = field(default_factory=lambda: np.zeros(N_JOINTS, dtype=np.int64))
    imu_temperature: int = 0  # °C
    remote: bytes = bytes(40)  # of the remote control, see `asks_to_stop`
    battery: Battery | None = None  # None of a robot that says nothing of it


def asks_to_stop(remote: bytes) -> bool:
    """Whether L2 and B are down together in the 40 bytes of a report: head, buttons, sticks."""
    return int.from_bytes(remote[2:4], "little") & _STOP == _STOP
