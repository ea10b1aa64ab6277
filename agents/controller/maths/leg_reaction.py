"""The force of the ground on each foot, from the torques and the motion of its leg."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadriga.agents.controller.maths.links import LINK, ZERO, leg_state
from quadriga.agents.controller.maths.spatial import Vector, momentum_of, power, vector_product
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.spec import Geometry
from quadriga.shared.runtime.jit import compiled

_STRETCHED = 0.1  # of the volume that the columns of J span, in cubes of the thigh's length


class LegMotion(NamedTuple):
    """What legs do, seen from a frame that moves with the trunk's origin.

    Attributes:
        q_joint: joint angles, (12,), rad.
        v_joint: joint rates, (12,), rad/s.
        tau_joint: joint torques, (12,), N·m.
        omega: angular velocity of the trunk, (3,), rad/s, trunk frame.
        specific_force: of the trunk's origin, (3,), m/s², trunk frame: gravity and acceleration.
    """

    q_joint: Array
    v_joint: Array
    tau_joint: Array
    omega: Array
    specific_force: Array


@compiled
def reaction_torques(motion: LegMotion, acceleration: Array, links: Array) -> tuple[Array, Array]:
    """Torques M q̈ + h − τ = Jᵀ f that the ground's forces have in the joints.

    The trunk's angular acceleration is left out: no sensor measures it.

    Args:
        motion: of the legs, and their torques.
        acceleration: q̈ of the joints, (12,), rad/s².
        links: `link_table`.

    Returns:
        h − τ and M q̈, (12,) each, N·m.
    """
    wx, wy, wz = motion.omega
    ax, ay, az = motion.specific_force
    trunk, gravity = (ZERO, (wx, wy, wz)), ((ax, ay, az), ZERO)
    static, inertial = np.empty(12), np.empty(12)
    for leg in range(4):
        k = 3 * leg
        q, rates, tau = motion.q_joint[k : k + 3], motion.v_joint[k : k + 3], motion.tau_joint
        rows = links[1 + k : 4 + k]
        state = leg_state(rows, q, rates, trunk, gravity)
        (S1, S2, S3), (link1, link2, link3) = state.axes, state.inertia
        f1, f2, f3 = state.force
        static[k], static[k + 1] = power(S1, f1) - tau[k], power(S2, f2) - tau[k + 1]
        static[k + 2] = power(S3, f3) - tau[k + 2]
        F1, F2, F3 = momentum_of(link1, S1), momentum_of(link2, S2), momentum_of(link3, S3)
        M12, M13, M23 = power(S1, F2), power(S1, F3), power(S2, F3)
        a, b, c = acceleration[k], acceleration[k + 1], acceleration[k + 2]
        M11, M22 = power(S1, F1) + rows[0, LINK.rotor], power(S2, F2) + rows[1, LINK.rotor]
        M33 = power(S3, F3) + rows[2, LINK.rotor]
        inertial[k] = M11 * a + M12 * b + M13 * c
        inertial[k + 1] = M12 * a + M22 * b + M23 * c
        inertial[k + 2] = M13 * a + M23 * b + M33 * c
    return static, inertial


@compiled
def foot_forces(torques: Array, q_joint: Array, geometry: Geometry) -> Array:
    """Forces f on the feet's centres with Jᵀ f = `torques`, (4, 3), N, trunk frame.

    Zero for a leg that is stretched so far that its torques do not tell the force.

    Args:
        torques: `reaction_torques`, (12,), N·m.
        q_joint: joint angles, (12,), rad.
        geometry: of the legs.
    """
    out = np.zeros((4, 3))
    for leg in range(4):
        first = 3 * leg
        J1, J2, J3 = _foot_jacobian(leg, q_joint[first : first + 3], geometry)
        n1, n2, n3 = vector_product(J2, J3), vector_product(J3, J1), vector_product(J1, J2)
        volume = J1[0] * n1[0] + J1[1] * n1[1] + J1[2] * n1[2]
        if abs(volume) < _STRETCHED * geometry.link**3:
            continue
        t1, t2, t3 = torques[first], torques[first + 1], torques[first + 2]
        for axis in range(3):
            out[leg, axis] = (t1 * n1[axis] + t2 * n2[axis] + t3 * n3[axis]) / volume
    return out


@compiled
def _foot_jacobian(leg: int, q: Array, geometry: Geometry) -> tuple[Vector, Vector, Vector]:
    """Velocities of a foot's centre at unit rate of its joints, trunk frame, m."""
    side = 1.0 if leg % 2 == 0 else -1.0
    link, y = geometry.link, side * geometry.thigh_y
    ca, sa = np.cos(q[0]), np.sin(q[0])
    # In the hip frame, before the roll by the hip angle about x; of thigh and calf.
    sb, cb = link * np.sin(q[1]), link * np.cos(q[1])
    sc, cc = link * np.sin(q[1] + q[2]), link * np.cos(q[1] + q[2])
    z = -(cb + cc)
    return (
        (0.0, -sa * y - ca * z, ca * y - sa * z),
        (z, -sa * (sb + sc), ca * (sb + sc)),
        (-cc, -sa * sc, ca * sc),
    )
