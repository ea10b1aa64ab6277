"""Rotations (unit quaternions w, x, y, z, trunk to odometry frame) and kinematics of the legs."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.spec import Geometry
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


@compiled
def leg_kinematics(
    q_joint: Array, v_joint: Array, geometry: Geometry | np.record
) -> tuple[Array, Array, Array]:
    """Foot centres, their velocities and the calves' angular velocities relative to the trunk.

    By joint angles, (12,), rad, and rates, (12,), rad/s.

    Returns:
        `p_foot` (4, 3) m, `v_foot` (4, 3) m/s and `omega_calf` (4, 3) rad/s, trunk frame,
        as seen from the trunk (its own motion not included).
    """
    link = geometry.link
    p_foot, v_foot, omega_calf = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    for leg in range(4):
        side = 1.0 if leg % 2 == 0 else -1.0
        a, b, c = q_joint[3 * leg], q_joint[3 * leg + 1], q_joint[3 * leg + 2]
        va, vb, vc = v_joint[3 * leg], v_joint[3 * leg + 1], v_joint[3 * leg + 2]
        # In the hip frame, before the roll by the hip angle a about x.
        x = -link * (np.sin(b) + np.sin(b + c))
        y = side * geometry.thigh_y
        z = -link * (np.cos(b) + np.cos(b + c))
        vx = -link * (np.cos(b) * vb + np.cos(b + c) * (vb + vc))
        vz = link * (np.sin(b) * vb + np.sin(b + c) * (vb + vc))
        ca, sa = np.cos(a), np.sin(a)
        p_foot[leg, 0] = (geometry.hip_x if leg < 2 else -geometry.hip_x) + x
        p_foot[leg, 1] = side * geometry.hip_y + ca * y - sa * z
        p_foot[leg, 2] = sa * y + ca * z
        v_foot[leg, 0] = vx
        v_foot[leg, 1] = -va * (sa * y + ca * z) - sa * vz
        v_foot[leg, 2] = va * (ca * y - sa * z) + ca * vz
        omega_calf[leg, 0] = va
        omega_calf[leg, 1] = ca * (vb + vc)
        omega_calf[leg, 2] = sa * (vb + vc)
    return p_foot, v_foot, omega_calf
