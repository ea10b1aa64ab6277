"""A robot's sensors: the ground truth with noise and errors, as a real robot would measure it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from quadriga.shared.config.sections import SensorsConfig
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import N_JOINTS, N_LEGS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.sim_server.world.layout import (
    ATTITUDE,
    FOOT_FORCES,
    JOINT_POSITIONS,
    JOINT_RATES,
    SPECIFIC_FORCE,
    TRUNK_RATE,
)

MEASURES, READS_ZERO, REPEATS = 0, 1, 2  # what a sensor does at a tick
_TICK: Final = 1e-3  # s

_STREAM: Final = 2  # of the seed: the terrain draws from another one
_ERRORS: Final = 1  # of that stream, for all errors but noise and the IMU's biases
# Columns of a robot's noise: joints, gyro, accelerometer and feet in the order of the fields of
# `State`, then the attitude, whose noise is a rotation and is not added.
_SIZES: Final = (N_JOINTS, N_JOINTS, N_JOINTS, 3, 3, N_LEGS, 3)
_Q, _V, _TAU, _GYRO, _ACCEL, _FOOT, _TURN = (
    slice(stop - size, stop) for size, stop in zip(_SIZES, accumulate(_SIZES), strict=True)
)
# Places of the fields in a state's row; the joints' three are one behind the other in both.
_STATE_QUAT, _STATE_GYRO, _STATE_ACCEL, _STATE_FOOT = (
    State.CUTS[name] for name in ("imu_quat_wxyz", "imu_gyro", "imu_accel", "foot_force")
)
_ROW: Final = _STATE_FOOT.stop  # numbers of a `State`
_BLOCK: Final = 64  # ticks of noise drawn at once, because many small draws cost more
_NEWTONS, _COUNTS, _NONE = 0, 1, 2  # what foot sensors measure, as compiled code is told
_FOOT_SENSORS: Final = {"newtons": _NEWTONS, "counts": _COUNTS, "none": _NONE}
_INT16: Final = np.iinfo(np.int16)
_MOST, _LEAST = float(_INT16.max), float(_INT16.min)

Faults = NDArray[np.int8]


class FootSensors:
    """Scale, offset, refresh rate and dropouts of all feet; each robot has a stream of its own.

    Attributes:
        scale: counts per N, (n, 4).
    """

    def __init__(self, config: SensorsConfig, streams: Sequence[Generator]) -> None:
        self._streams = streams
        shape = (len(streams), N_LEGS)
        spread, bias = np.empty(shape), np.empty(shape)
        for i, stream in enumerate(streams):
            spread[i], bias[i] = stream.standard_normal((2, N_LEGS))
        self.scale = config.foot_scale * np.exp(config.foot_scale_spread * spread)
        self._offset = config.foot_offset + config.foot_bias * bias
        self._refresh = _TICK * config.foot_refresh_rate
        self._drift = config.foot_drift
        self._rate = _TICK * config.foot_dropout_rate
        self._duration = max(1.0, config.foot_dropout_ms)
        # The next dropout of each foot: its first and last tick, and what the sensor then does.
        self._begin, self._end = np.full(shape, np.inf), np.full(shape, -np.inf)
        self._fault = np.zeros(shape, dtype=np.int8)
        self._tick = 0
        for i in range(shape[0]):
            for leg in range(N_LEGS):
                self._draw_dropout(i, leg, 0.0)

    def draw(self, ticks: int) -> tuple[Array, Faults]:
        """Counts of an unloaded foot, and what sensors do, in the next ticks; both (ticks, n, 4).

        Drift goes on from one call to the next; within a block it is a straight line.
        """
        target = self._offset + self._drift * np.sqrt(_TICK * ticks) * np.stack(
            [stream.standard_normal(N_LEGS) for stream in self._streams]
        )
        share = np.arange(1, ticks + 1)[:, None, None] / ticks
        offset = self._offset + share * (target - self._offset)
        self._offset = target
        return offset, self._faults(ticks)

    def _faults(self, ticks: int) -> Faults:
        """What each foot's sensor does in the next ticks, (ticks, n, 4)."""
        first, last = self._tick, self._tick + ticks
        self._tick = last
        count = np.floor(self._refresh * np.arange(first - 1, last))  # of readings so far
        held = np.where(np.diff(count) > 0.0, MEASURES, REPEATS).astype(np.int8)
        faults = np.tile(held[:, None, None], (1, *self._begin.shape))
        for i, leg in np.argwhere(self._begin < last):
            while self._begin[i, leg] < last:
                begin, end = self._begin[i, leg], self._end[i, leg]
                within = slice(max(0, int(begin) - first), max(0, int(min(end, last)) - first))
                faults[within, i, leg] = self._fault[i, leg]
                if end >= last:
                    break
                self._draw_dropout(i, leg, end)
        return faults

    def _draw_dropout(self, i: int, leg: int, after: float) -> None:
        """Draw when a foot's sensor fails next, and how."""
        if self._rate <= 0.0:
            return
        stream = self._streams[i]
        self._begin[i, leg] = after + stream.exponential(1.0 / self._rate)
        self._end[i, leg] = self._begin[i, leg] + 1.0 + stream.exponential(self._duration)
        self._fault[i, leg] = READS_ZERO if stream.random() < 0.5 else REPEATS


class Sensors:
    """The sensors of all robots; each robot's noise has its own stream of (seed, robot index).

    So a robot's noise depends neither on the number of robots nor on what the others do. The
    errors of encoders, attitude and feet have another stream each, so that they change no noise.
    """

    def __init__(self, config: SensorsConfig, seed: int, indices: Sequence[int]) -> None:
        """Sensors of the robots with these indices in the team."""
        n = len(indices)
        self._streams = [np.random.default_rng((seed, _STREAM, i)) for i in indices]
        others = [np.random.default_rng((seed, _STREAM, i, _ERRORS)) for i in indices]
        joints = config.joint_position, config.joint_velocity, config.joint_torque
        imu_and_feet = config.gyro, config.accel, config.foot_force, config.orientation
        self._sigma = np.repeat([*joints, *imu_and_feet], _SIZES)
        self._bias, self._yaw_rate = np.zeros((n, _TURN.stop)), np.zeros(n)
        for i, (stream, other) in enumerate(zip(self._streams, others, strict=True)):
            bias = self._bias[i]
            bias[_GYRO] = config.gyro_bias * stream.standard_normal(3)
            bias[_ACCEL] = config.accel_bias * stream.standard_normal(3)
            bias[_Q] = config.joint_offset * other.standard_normal(N_JOINTS)
            bias[_TURN][:2] = config.orientation_bias * other.standard_normal(2)
            self._yaw_rate[i] = config.yaw_drift * other.standard_normal()
        self._kind = _FOOT_SENSORS[config.foot_sensor]
        self._feet = FootSensors(config, others)
        self._last = np.zeros((n, N_LEGS))  # what the feet's sensors read last
        self._next = _BLOCK  # row of the block that the next measurement takes
        self._noise, self._turns, self._unloaded = np.empty(0), np.empty(0), np.empty(0)
        self._faults: Faults = np.empty(0, dtype=np.int8)

    def measure(self, tick: int, q: Array, v: Array, tau: Array, sensed: Array) -> Array:
        """The rows of the `State`s of one tick, (n, 50); every call draws fresh noise.

        Args:
            tick: ms.
            q: true coordinates of each robot, trunk position and attitude first, (n, 19).
            v: true velocities, (n, 18): of the trunk, its rate in its own frame, of the joints.
            tau: true torques of the motors, before friction, (n, 12), N·m.
            sensed: true specific force and normal foot forces, units and frames as in `State`, in
                its columns 3 … 9; shape (n, ≥ 10).
        """
        if self._next == _BLOCK:
            self._draw()
        rows, now = np.empty((len(q), _ROW)), self._next
        yaw = self._yaw_rate * (1e-3 * tick)
        _observe(q, v, tau, sensed, self._noise[now], self._turns[now], yaw, rows)
        _convert_foot_forces(
            self._kind, self._feet.scale, self._unloaded, self._faults, now, self._last, rows
        )
        self._next += 1
        return rows

    def _draw(self) -> None:
        """Draw the next block: noise plus bias, (_BLOCK, n, 49), and turns, (_BLOCK, n, 4).

        A turn is the small rotation by a vector r in the trunk's frame, as the quaternion
        (1, r/2), normalised: exact to third order in the angle.
        """
        draws = [stream.standard_normal((_BLOCK, _TURN.stop)) for stream in self._streams]
        self._noise = np.stack(draws, axis=1) * self._sigma + self._bias
        self._turns = np.ones((*self._noise.shape[:2], 4))
        self._turns[..., 1:] = 0.5 * self._noise[..., _TURN]
        self._turns /= np.linalg.norm(self._turns, axis=-1, keepdims=True)
        self._unloaded, self._faults = self._feet.draw(_BLOCK)
        self._next = 0


@compiled
def _observe(
    q: Array,
    v: Array,
    tau: Array,
    sensed: Array,
    noise: Array,
    turns: Array,
    yaw: Array,
    rows: Array,
) -> None:
    """Fill the rows of all robots' states; `yaw`, (n,), is the drift of their headings, rad."""
    for i in range(len(rows)):
        row, extra = rows[i], noise[i]
        row[_Q] = extra[_Q] + q[i, JOINT_POSITIONS]
        row[_V] = extra[_V] + v[i, JOINT_RATES]
        row[_TAU] = extra[_TAU] + tau[i]
        row[_STATE_GYRO] = extra[_GYRO] + v[i, TRUNK_RATE]
        row[_STATE_ACCEL] = extra[_ACCEL] + sensed[i, SPECIFIC_FORCE]
        row[_STATE_FOOT] = extra[_FOOT] + sensed[i, FOOT_FORCES]
        # The measured attitude is the drift about the world's z ⊗ the true one ⊗ the turn.
        attitude, turn = q[i, ATTITUDE], turns[i]
        a, b, c, d = attitude[0], attitude[1], attitude[2], attitude[3]
        p, r, s, t = turn[0], turn[1], turn[2], turn[3]
        w, x = p * a - r * b - s * c - t * d, r * a + p * b + t * c - s * d
        y, z = s * a - t * b + p * c + r * d, t * a + s * b - r * c + p * d
        cos, sin = np.cos(0.5 * yaw[i]), np.sin(0.5 * yaw[i])
        quat = row[_STATE_QUAT]
        quat[0], quat[1] = cos * w - sin * z, cos * x - sin * y
        quat[2], quat[3] = cos * y + sin * x, cos * z + sin * w


@compiled
def _convert_foot_forces(
    kind: int, scale: Array, unloaded: Array, faults: Faults, now: int, last: Array, rows: Array
) -> None:
    """Make of the noisy normal forces in the states' rows what the sensors say of them.

    They have `scale` counts per N and some counts `unloaded`; `last`, what each read last, changes
    in place. All are of shape (n, 4), of the block of draws those `now`.
    """
    for i in range(len(rows)):
        feet = rows[i, _STATE_FOOT]
        for foot in range(N_LEGS):
            if kind == _NONE:
                feet[foot] = 0.0
            elif kind == _NEWTONS:
                feet[foot] = max(0.0, feet[foot])  # such a sensor cannot pull
            else:
                fault = faults[now, i, foot]
                if fault == MEASURES:
                    counts = np.rint(scale[i, foot] * feet[foot] + unloaded[now, i, foot])
                    last[i, foot] = min(_MOST, max(_LEAST, counts))
                feet[foot] = 0.0 if fault == READS_ZERO else last[i, foot]
