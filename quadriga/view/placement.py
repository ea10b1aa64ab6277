"""Where trunks go that move as they say: dead reckoning, and the way a plan predicts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.shared.robot.conventions import OUTPUTS, Array
from quadriga.shared.wire.messages import Measurement
from quadriga.shared.wire.topics import SAMPLE_MS

LONGEST_MS: Final = 200  # a robot that was not heard for longer is where it was heard last


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a robot is by its own account, from the place where it was taken to begin.

    Attributes:
        tick: of the measurement that it is by, ms.
        x, y: of the trunk's origin, m.
        yaw: rad.
    """

    tick: int
    x: float
    y: float
    yaw: float

    def follow(self, measurement: Measurement) -> Placement:
        """The place at a later measurement, which gives the speeds since this one."""
        ms = measurement.tick - self.tick
        if ms <= 0:
            return self
        if ms > LONGEST_MS:
            return Placement(measurement.tick, self.x, self.y, self.yaw)
        here = np.array([self.x, self.y, self.yaw])
        x, y, yaw = follow_speeds(here, measurement.y[None], 1e-3 * ms)[0].tolist()
        return Placement(measurement.tick, x, y, yaw)


def follow_speeds(place: Array, outputs: Array, seconds: float = 1e-3 * SAMPLE_MS) -> Array:
    """The way of a trunk, or of several, that keeps the speeds of each row for some time.

    Exact for constant speeds: the way of one row is an arc, Δ = R(ψ + ω t / 2) v t sinc(ω t / 2).

    Args:
        place: where it begins: x, y, yaw, shape (…, 3), m and rad.
        outputs: z, vx, vy, roll, pitch, wz; shape (…, N, 6), velocities in the yaw frame.
        seconds: for which each row holds, s.

    Returns:
        x, y, yaw at the end of each row, shape (…, N, 3).
    """
    vx, vy, wz = (outputs[..., OUTPUTS.index(name)] for name in ("vx", "vy", "wz"))
    turn = wz * seconds
    way = np.empty((*turn.shape, 3))
    way[..., 2] = place[..., 2:] + np.cumsum(turn, axis=-1)
    middle = way[..., 2] - turn / 2.0
    chord = seconds * np.sinc(turn / (2.0 * np.pi))
    cos, sin = np.cos(middle), np.sin(middle)
    way[..., 0] = place[..., :1] + np.cumsum(chord * (cos * vx - sin * vy), axis=-1)
    way[..., 1] = place[..., 1:2] + np.cumsum(chord * (sin * vx + cos * vy), axis=-1)
    return way


def quat_of(roll: Array, pitch: Array, yaw: Array) -> Array:
    """Quaternion wxyz of R_z(yaw) R_y(pitch) R_x(roll). Shape (…, 4)."""
    cr, sr = np.cos(roll / 2.0), np.sin(roll / 2.0)
    cp, sp = np.cos(pitch / 2.0), np.sin(pitch / 2.0)
    cy, sy = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )
