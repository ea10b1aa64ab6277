"""Closed-form leg kinematics in the trunk frame, for the estimator."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.spec import Geometry
from quadriga.shared.runtime.jit import compiled


@compiled
def leg_kinematics(
    q_joint: Array, v_joint: Array, geometry: Geometry
) -> tuple[Array, Array, Array]:
    """Foot centres, their velocities and the calves' angular velocities relative to the trunk.

    Args:
        q_joint: joint angles, shape (12,), rad.
        v_joint: joint rates, shape (12,), rad/s.
        geometry: of the robot.

    Returns:
        `p_foot` (4, 3) m, `v_foot` (4, 3) m/s and `omega_calf` (4, 3) rad/s, trunk frame,
        as seen from the trunk (its own motion not included).
    """
    hip_x, hip_y, thigh_y, link, _, _ = geometry
    p_foot = np.empty((4, 3))
    v_foot = np.empty((4, 3))
    omega_calf = np.empty((4, 3))
    for leg in range(4):
        side = 1.0 if leg % 2 == 0 else -1.0
        a, b, c = q_joint[3 * leg], q_joint[3 * leg + 1], q_joint[3 * leg + 2]
        va, vb, vc = v_joint[3 * leg], v_joint[3 * leg + 1], v_joint[3 * leg + 2]
        # In the hip frame, before the roll by the hip angle a about x.
        x = -link * (np.sin(b) + np.sin(b + c))
        y = side * thigh_y
        z = -link * (np.cos(b) + np.cos(b + c))
        vx = -link * (np.cos(b) * vb + np.cos(b + c) * (vb + vc))
        vz = link * (np.sin(b) * vb + np.sin(b + c) * (vb + vc))
        ca, sa = np.cos(a), np.sin(a)
        p_foot[leg, 0] = (hip_x if leg < 2 else -hip_x) + x
        p_foot[leg, 1] = side * hip_y + ca * y - sa * z
        p_foot[leg, 2] = sa * y + ca * z
        v_foot[leg, 0] = vx
        v_foot[leg, 1] = -va * (sa * y + ca * z) - sa * vz
        v_foot[leg, 2] = va * (ca * y - sa * z) + ca * vz
        omega_calf[leg, 0] = va
        omega_calf[leg, 1] = ca * (vb + vc)
        omega_calf[leg, 2] = sa * (vb + vc)
    return p_foot, v_foot, omega_calf
