"""Rotations the controller needs: unit quaternions (w, x, y, z), trunk to world."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled


@compiled
def rotation_matrix(quat_wxyz: Array) -> Array:
    """Rotation matrix of a quaternion of any positive norm. Shape (3, 3)."""
    w, x, y, z = quat_wxyz / np.sqrt(np.sum(quat_wxyz * quat_wxyz))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@compiled
def roll_pitch_yaw(R: Array) -> Array:
    """Angles of R = R_z(yaw) R_y(pitch) R_x(roll). Shape (3,), rad."""
    return np.array(
        [
            np.arctan2(R[2, 1], R[2, 2]),
            np.arcsin(min(1.0, max(-1.0, -R[2, 0]))),
            np.arctan2(R[1, 0], R[0, 0]),
        ]
    )


@compiled
def heading(R: Array) -> tuple[float, float]:
    """Cosine and sine of the yaw of R; of a trunk that points straight up or down, yaw is 0."""
    norm = np.sqrt(R[0, 0] ** 2 + R[1, 0] ** 2)
    if norm == 0.0:
        return 1.0, 0.0
    return R[0, 0] / norm, R[1, 0] / norm


@compiled
def cross(a: Array, b: Array) -> Array:
    """Vector product of two vectors of shape (3,)."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


@compiled
def wrap_angle(angle: float) -> float:
    """The same angle in (−π, π]."""
    return float(np.arctan2(np.sin(angle), np.cos(angle)))
