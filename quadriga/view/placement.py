"""Where trunks are that move as they say, from where each is taken to begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.recordings.dead_reckoning import follow_speeds
from quadriga.shared.messages import Measurement
from quadriga.shared.robots.conventions import Array

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
