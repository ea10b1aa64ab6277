"""The way that a plan means a trunk to go."""

from __future__ import annotations

import numpy as np

from quadriga.recordings.dead_reckoning import follow_speeds
from quadriga.shared.robots.conventions import Array


def predict_path(y: Array, position: Array, yaw: float) -> Array:
    """Positions of the trunk at the beginning of a plan and after each of its samples.

    Args:
        y: planned outputs z, vx, vy, roll, pitch, wz, shape (N, 6), yaw frame, SI.
        position: of the trunk when the plan begins, shape (3,), m, world.
        yaw: of the trunk then, rad.

    Returns:
        Shape (N + 1, 3), m, world. Heights are planned over the ground that the feet feel, so only
        their change is taken over.
    """
    path = np.empty((len(y) + 1, 3))
    path[0] = position
    path[1:, :2] = follow_speeds(np.array([position[0], position[1], yaw]), y)[:, :2]
    path[1:, 2] = position[2] + y[:, 0] - y[0, 0]
    return path
