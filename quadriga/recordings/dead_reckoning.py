"""Where a trunk comes to that keeps some speeds for some time: dead reckoning."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robots.conventions import OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS


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
