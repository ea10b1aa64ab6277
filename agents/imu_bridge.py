"""What an agent believes of its IMU, and what else while that says nothing, or what cannot be.

A reading is not believed that has no attitude, whose attitude has jumped against its gyro, that
stays the same although its gyro turns, that is late (`agents.imu_delay`), or whose gravity points
upwards; nor an accelerometer alone that is at the end of its range, says nothing, or stays the
same. Then the legs stand for it: the attitude goes on from the last one as two feet that stand tell
how the trunk turns, and what the feet bear is its specific force. They do not tell all, so that a
trot goes on for some tenths of a second only; soon the robot stands by its joints alone
(`agents.held_posture`). What an IMU says afterwards is believed again once it has agreed with
itself for a while; it need not agree with what was assumed.
"""

from __future__ import annotations

from dataclasses import field
from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.foot_load import FOOT_LOAD
from quadriga.agents.controller.maths.rows import numbers, places, row_size
from quadriga.agents.controller.memory import MEMORY, MEMORY_SIZE, Memory
from quadriga.agents.imu_delay import DELAY, find_delay, nothing_said
from quadriga.shared.robot.conventions import GRAVITY, Array
from quadriga.shared.robot.spec import N_GEOMETRY, Geometry, RobotSpec
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.messages import State

BELIEVED_AFTER_MS: Final = 20  # for which readings must be in agreement once one was not

_JUMP: Final = 0.1  # rad, of an attitude against its gyro from one reading to the next
_SAME_MS: Final = 20  # for which readings may be equal to the last digit: IMUs may be slow
_TURNS: Final = 1e-3  # rad/s, of a gyro that says that the robot moves
_RANGE: Final = 150.0  # m/s², of an accelerometer: those of such robots end at 16 g
_TURN_MOST: Final = 5.0  # rad/s; faster than any trunk turns that does not fall
_UP_TIME: Final = 0.01  # s, time constant of the force that holds the trunk against gravity
_UP_LEAST: Final = -3.0  # m/s²; nothing pulls a trunk down by so much for so long
_UP_AGAIN: Final = 3.0  # m/s²; one that falls freely feels nothing, whichever way its IMU reads
_LIFT_MOST: Final = 3.0 * GRAVITY  # legs push a trunk up by no more
_QUAT_NORM2: Final = (0.5, 2.0)  # |q|² of an attitude
_IMU: Final = slice(State.CUTS["imu_quat_wxyz"].start, State.CUTS["imu_accel"].stop)
_FOOT_FORCE: Final = slice(
    MEMORY.foot_load.start + FOOT_LOAD.force.start, MEMORY.foot_load.start + FOOT_LOAD.force.stop
)
_NO_MEMORY: Final = np.zeros(MEMORY_SIZE)  # no foot stands, none bears
_QUAT, _GYRO, _ACCEL = slice(0, 4), slice(4, 7), slice(7, 10)  # of what an IMU says


class ImuLayout(NamedTuple):
    """Where the row of what is remembered keeps what.

    Attributes:
        begun: 1 once there was a reading.
        believed: attitude, gyro and accelerometer as they were believed last, (10,).
        read: the same as they were read last, (10,).
        same: time for which all of it has been the same, ms.
        same_accel: likewise of the accelerometer alone.
        agrees: time for which readings have been in agreement, ms.
        agrees_accel: likewise of the accelerometer alone.
        up: filtered specific force along the vertical by the attitude that was read, m/s².
        missing: time since the last attitude that was believed, ms.
    """

    begun: int
    believed: slice
    read: slice
    same: int
    same_accel: int
    agrees: int
    agrees_accel: int
    up: int
    missing: int


IMU: Final = ImuLayout(
    **places(
        begun=1,
        believed=10,
        read=10,
        same=1,
        same_accel=1,
        agrees=1,
        agrees_accel=1,
        up=1,
        missing=1,
    )
)


def _initial_row() -> Array:
    """Nothing has been read yet: the trunk is level."""
    row = np.zeros(row_size(IMU))
    row[IMU.believed] = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY)
    row[[IMU.agrees, IMU.agrees_accel]] = BELIEVED_AFTER_MS
    row[IMU.up] = GRAVITY
    return row


@record
class ImuState:
    """What an agent remembers of its IMU.

    Attributes:
        row: see `ImuLayout`.
        legs: what `agents.imu_delay` remembers of what the legs said.
        bridged: whether something else was believed at the last tick than was read.
    """

    row: Array = field(default_factory=_initial_row)
    legs: Array = field(default_factory=nothing_said)
    bridged: bool = False

    @property
    def missing_ms(self) -> float:
        """For how long no attitude has been believed."""
        return float(self.row[IMU.missing])


class ImuBridge:
    """Fixed data of what an agent believes of its IMU.

    Args:
        robot: its kind.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._geometry = np.array(robot.geometry)

    def step(
        self, before: ImuState, state: State, memory: Memory | None, ticks: int, dt: float
    ) -> tuple[ImuState, State]:
        """What is remembered after a tick, and its state with what is believed of the IMU.

        Args:
            before: what was remembered.
            state: what was read.
            memory: of the low level, which knows the feet; None: it has none yet.
            ticks: since the last reading.
            dt: that time, as far as filters go on by it, s.
        """
        row, legs = before.row.copy(), before.legs.copy()
        flat = _NO_MEMORY if memory is None else memory.flat
        if _believe(row, legs, state.row, flat, self._geometry, state.tick, ticks, dt):
            return ImuState(row, legs), state
        bridged = state.row.copy()
        bridged[_IMU] = row[IMU.believed]
        believed = State.from_row(state.tick, state.stamp_ns, bridged)
        return ImuState(row, legs, bridged=True), believed


@compiled
def _believe(
    row: Array,
    legs: Array,
    state: Array,
    memory: Array,
    constants: Array,
    tick: int,
    ticks: int,
    dt: float,
) -> bool:
    """Whether all that an IMU says is believed; `row` and `legs` are brought up to date."""
    geometry = Geometry(*numbers(constants, N_GEOMETRY))
    late = find_delay(legs, state, memory, tick, ticks, geometry)
    imu, believed = state[_IMU], row[IMU.believed]
    attitude, accel = _judge(row, imu, dt, late)
    if not attitude:
        _turn_on(believed, legs[DELAY.turn], dt)
    if not accel:
        lift = _lift(memory[_FOOT_FORCE], geometry.mass)
        believed[_ACCEL] = lift * _vertical(believed[_QUAT])
    return attitude and accel


@compiled
def _judge(memory: Array, imu: Array, dt: float, late: bool) -> tuple[bool, bool]:
    """Whether attitude and gyro are believed, and the accelerometer; `memory` goes on."""
    before, believed, ms = memory[IMU.read].copy(), memory[IMU.believed], 1e3 * dt
    attitude = _is_attitude(imu[_QUAT])
    agrees = attitude and (memory[IMU.begun] < 0.5 or _follows(before, imu, dt))
    _count_same(memory, before, imu, ms)
    memory[IMU.read] = imu
    memory[IMU.begun] = 1.0 if attitude else memory[IMU.begun]
    moves = np.max(np.abs(imu[_GYRO])) > _TURNS
    agrees = agrees and not late and not (moves and memory[IMU.same] >= _SAME_MS)
    if attitude:
        _note_vertical(memory, imu, dt)
    # Of an IMU that was not believed, gravity must point downwards, too.
    agrees = agrees and (memory[IMU.missing] <= 0.0 or memory[IMU.up] >= _UP_AGAIN)
    memory[IMU.agrees] = memory[IMU.agrees] + ms if agrees else 0.0
    whole = agrees and memory[IMU.agrees] >= BELIEVED_AFTER_MS
    if whole:
        believed[:7] = imu[:7]
    memory[IMU.missing] = 0.0 if whole else memory[IMU.missing] + ms
    return whole, _judge_accel(memory, imu[_ACCEL], moves, ms)


@compiled
def _turn_on(believed: Array, turn: Array, dt: float) -> None:
    """Go on from the last attitude as the legs say that the trunk turns, rad/s."""
    believed[_GYRO] = np.minimum(_TURN_MOST, np.maximum(-_TURN_MOST, turn))
    quat = _turned(believed[_QUAT], dt * believed[_GYRO])
    believed[_QUAT] = quat / np.sqrt(np.sum(quat * quat))


@compiled
def _judge_accel(memory: Array, accel: Array, moves: bool, ms: float) -> bool:
    """Whether the accelerometer is believed, and if so, what it says."""
    same = moves and memory[IMU.same_accel] >= _SAME_MS
    agrees = _is_in_range(accel) and not same and memory[IMU.up] >= _UP_LEAST
    memory[IMU.agrees_accel] = memory[IMU.agrees_accel] + ms if agrees else 0.0
    long_enough = memory[IMU.agrees_accel] >= BELIEVED_AFTER_MS
    believes = agrees and long_enough and memory[IMU.missing] <= 0.0
    if believes:
        memory[IMU.believed][_ACCEL] = accel
    return believes


@compiled
def _lift(foot_force: Array, mass: float) -> float:
    """The trunk's specific force upwards as the feet tell it, m/s²: a trot bounces.

    Args:
        foot_force: of the ground on the feet by the joints' torques, (12,), N, odometry frame; all
            zero where nobody has told it: then gravity alone is balanced.
        mass: of the robot, kg.
    """
    if not np.any(foot_force):
        return GRAVITY
    return min(_LIFT_MOST, max(0.0, np.sum(foot_force[2::3]) / mass))


@compiled
def _note_vertical(memory: Array, imu: Array, dt: float) -> None:
    """Filter the force along the IMU's own vertical that it measures, while it measures."""
    if _is_in_range(imu[_ACCEL]):
        up = np.sum(_vertical(imu[_QUAT]) * imu[_ACCEL])
        memory[IMU.up] += dt / (_UP_TIME + dt) * (up - memory[IMU.up])


@compiled
def _is_in_range(accel: Array) -> bool:
    return bool(0.0 < np.max(np.abs(accel)) < _RANGE)


@compiled
def _is_attitude(quat_wxyz: Array) -> bool:
    norm2 = np.sum(quat_wxyz * quat_wxyz)
    return bool(_QUAT_NORM2[0] < norm2 < _QUAT_NORM2[1])


@compiled
def _follows(before: Array, imu: Array, dt: float) -> bool:
    """Whether an attitude follows from the one before by the gyro."""
    if not _is_attitude(before[_QUAT]):
        return False
    # Half the sine of the angle between what follows and what is read.
    expected = _turned(before[_QUAT], 0.5 * dt * (before[_GYRO] + imu[_GYRO]))
    quat = imu[_QUAT]
    cosine = abs(np.sum(expected * quat)) / np.sqrt(
        np.sum(expected * expected) * np.sum(quat * quat)
    )
    return bool(cosine >= np.cos(0.5 * _JUMP))


@compiled
def _turned(quat_wxyz: Array, angle: Array) -> Array:
    """An attitude, turned by small angles about the trunk's axes, (3,), rad: q ⊗ (1, angle / 2)."""
    w, x, y, z = quat_wxyz
    a, b, c = 0.5 * angle
    return np.array(
        [
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        ]
    )


@compiled
def _count_same(memory: Array, before: Array, imu: Array, ms: float) -> None:
    same_accel = np.all(imu[_ACCEL] == before[_ACCEL])
    same = same_accel and np.all(imu == before)
    memory[IMU.same] = memory[IMU.same] + ms if same else 0.0
    memory[IMU.same_accel] = memory[IMU.same_accel] + ms if same_accel else 0.0


@compiled
def _vertical(quat_wxyz: Array) -> Array:
    """The vertical in the trunk's frame by an attitude, (3,)."""
    w, x, y, z = quat_wxyz / np.sqrt(np.sum(quat_wxyz * quat_wxyz))
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
