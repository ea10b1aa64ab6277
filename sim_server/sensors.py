"""What a robot's sensors make of the true state: noise, bias, and nothing a real one lacks."""

from __future__ import annotations

from typing import Final

import numpy as np

from shared.config import SensorsConfig
from shared.messages import State
from shared.robot import N_JOINTS, N_LEGS, Array

_STREAM: Final = 2  # of the seed: the terrain draws from another one
# Channels of one robot, in the order of the fields of `State` but for the attitude, which is last
# because its noise is a rotation and not a sum.
_Q = slice(0, N_JOINTS)
_V = slice(_Q.stop, _Q.stop + N_JOINTS)
_TAU = slice(_V.stop, _V.stop + N_JOINTS)
_GYRO = slice(_TAU.stop, _TAU.stop + 3)
_ACCEL = slice(_GYRO.stop, _GYRO.stop + 3)
_FOOT = slice(_ACCEL.stop, _ACCEL.stop + N_LEGS)
N_CHANNELS: Final = _FOOT.stop  # those that `Sensors.measure` takes as one array
_TURN = slice(_FOOT.stop, _FOOT.stop + 3)

_BLOCK: Final = 64  # ticks of noise drawn at once, because many small draws cost more

# Q(p) with q ⊗ p = Q(p) q is _SIGN[a, b] · p[_INDEX[a, b]], quaternions wxyz.
_INDEX: Final = np.array([[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]])
_SIGN: Final = np.array([[1, -1, -1, -1], [1, 1, 1, -1], [1, -1, 1, 1], [1, 1, -1, 1]], dtype=float)


class Sensors:
    """The sensors of all robots; each robot's noise has its own stream of (seed, robot index).

    So a robot's noise depends neither on how many others there are nor on what they do.
    """

    def __init__(self, config: SensorsConfig, seed: int, names: tuple[str, ...]) -> None:
        self._names = names
        self._streams = [np.random.default_rng((seed, _STREAM, i)) for i in range(len(names))]
        self._sigma = np.empty(_TURN.stop)
        for channel, sigma in (
            (_Q, config.joint_position), (_V, config.joint_velocity), (_TAU, config.joint_torque),
            (_GYRO, config.gyro), (_ACCEL, config.accel), (_FOOT, config.foot_force),
            (_TURN, config.orientation),
        ):  # fmt: skip
            self._sigma[channel] = sigma
        self._bias = np.zeros((len(names), N_CHANNELS))
        for row, stream in zip(self._bias, self._streams, strict=True):
            row[_GYRO] = config.gyro_bias * stream.standard_normal(3)
            row[_ACCEL] = config.accel_bias * stream.standard_normal(3)

        self._next = _BLOCK  # row of the block that the next measurement takes
        self._block, self._turns = np.empty(0), np.empty(0)

    def measure(self, tick: int, channels: Array, quat_wxyz: Array) -> dict[str, State]:
        """The messages of one tick; every call draws fresh noise.

        Args:
            tick: the messages' tick, ms.
            channels: true q, v, tau of the joints, angular rate, specific force and normal foot
                forces, shape (n, 46), units and frames as in `State`.
            quat_wxyz: true attitudes, trunk to world, shape (n, 4).
        """
        if self._next == _BLOCK:
            self._draw()
        x, turn = self._block[self._next], self._turns[self._next]
        self._next += 1
        x += channels
        foot = x[:, _FOOT]
        np.maximum(foot, 0.0, out=foot)  # a foot sensor cannot pull
        quat = (turn @ quat_wxyz[:, :, None])[:, :, 0]
        # As from the wire: the compiler tells read-only arrays apart and would compile twice.
        x.setflags(write=False)
        quat.setflags(write=False)
        return {
            name: State(
                tick=tick, stamp_ns=tick * 1_000_000,
                q_joint=x[i, _Q], v_joint=x[i, _V], tau_joint=x[i, _TAU], imu_quat_wxyz=quat[i],
                imu_gyro=x[i, _GYRO], imu_accel=x[i, _ACCEL], foot_force=x[i, _FOOT],
            )
            for i, name in enumerate(self._names)
        }  # fmt: skip

    def _draw(self) -> None:
        """Draw the next block: noise plus bias (_BLOCK, n, 46), and turns (_BLOCK, n, 4, 4)."""
        draws = [stream.standard_normal((_BLOCK, _TURN.stop)) for stream in self._streams]
        noise = np.stack(draws, axis=1) * self._sigma
        self._block = noise[:, :, :N_CHANNELS] + self._bias
        self._turns = turn_matrices(noise[:, :, _TURN])
        self._next = 0


def turn_matrices(rotation: Array) -> Array:
    """Matrices Q with Q q = q ⊗ p for the small rotations p by `rotation` in the trunk's frame.

    p = (1, r/2), normalised: exact to third order in the angle.

    Args:
        rotation: rotation vectors, shape (..., 3), rad.

    Returns:
        Shape (..., 4, 4), for quaternions wxyz.
    """
    p = np.concatenate([np.ones((*rotation.shape[:-1], 1)), 0.5 * rotation], axis=-1)
    p /= np.linalg.norm(p, axis=-1, keepdims=True)
    matrices: Array = _SIGN * p[..., _INDEX]
    return matrices
