"""The rigid-body terms of a trunk with four legs of three joints, as one compiled function.

A general library is made for any robot and called once for each term; with cold caches that cost
nearly as much as the rest of the whole-body QP. Here everything is a spatial vector about the
trunk's origin, in the trunk's frame (recursive Newton-Euler and composite rigid bodies:
Featherstone, Rigid Body Dynamics Algorithms, 2008); legs touch each other through the trunk alone,
so M⁻¹ comes from four 3×3 blocks and one Schur complement of 6×6.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio as pin

from quadriga.agents.controller.maths.dense import factorise, product, solve_factorised
from quadriga.agents.controller.maths.rotation import rotation_matrix
from quadriga.agents.controller.maths.spatial import (
    Inertia,
    Spatial,
    Symmetric,
    Vector,
    added,
    combined,
    inertial_force,
    joined,
    momentum_of,
    motion_cross,
    plus,
    power,
    scaled,
    to_world,
    vector_product,
)
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.a1 import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_JOINTS: Final = ("JointModelFreeFlyer", *4 * ("JointModelRX", "JointModelRY", "JointModelRY"))


def link_table(model: pin.Model) -> Array:
    """What `rigid_body_terms` knows of the trunk and the twelve links. Shape (13, 13).

    Columns: mass, kg; centre of mass (3), m; moments about it xx, xy, xz, yy, yz, zz, kg·m²;
    where the link's joint is on the link before (3), m.

    Raises:
        ConfigError: the model is not a trunk with four legs whose joints turn about x, y and y.
    """
    joints = tuple(joint.shortname() for joint in list(model.joints)[1:])
    places, inertias = list(model.jointPlacements)[1:], list(model.inertias)[1:]
    turned = [place for place in places if not np.array_equal(place.rotation, np.eye(3))]
    if joints != _JOINTS or turned:
        raise ConfigError(
            "robot",
            f"joints {', '.join(joints)}, {len(turned)} of them mounted at an angle",
            "four legs with a hip that turns about x, a thigh and a calf about y",
            "another robot",
        )
    upper = np.triu_indices(3)
    return np.array(
        [
            [link.mass, *link.lever, *link.inertia[upper], *place.translation]
            for link, place in zip(inertias, places, strict=True)
        ]
    )


@compiled
def rigid_body_terms(
    q: Array, v: Array, links: Array, M_inverse: Array, nle: Array, J: Array, dJ: Array
) -> None:
    """Fill the terms of M(q) v̇ + h(q, v) = S τ + Jᵀ f, in the shapes of `Terms`.

    q, (19,), with a normalised quaternion, and v, (18,), are Pinocchio's coordinates; `links` is
    `link_table`.
    """
    R = rotation_matrix(np.array([q[6], q[3], q[4], q[5]]))
    position = (q[0], q[1], q[2])
    velocity = ((v[0], v[1], v[2]), (v[3], v[4], v[5]))
    # Gravity is an acceleration of the whole frame upwards.
    lifted = ((GRAVITY * R[2, 0], GRAVITY * R[2, 1], GRAVITY * R[2, 2]), (0.0, 0.0, 0.0))
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

    whole = _inertia(links[0], x, y, z, (0.0, 0.0, 0.0))
    force = inertial_force(whole, velocity, lifted)
    turn = np.zeros((6, 12))  # F D⁻¹: what the trunk feels of the legs' joints
    reduced = np.zeros((6, 6))
    M_inverse[:, :] = 0.0
    for column in range(3):
        axis = (R[0, column], R[1, column], R[2, column])
        _put(J, column, axis, (0.0, 0.0, 0.0))
        _put(J, 3 + column, vector_product(position, axis), axis)
    moved = to_world(R, position, velocity)
    for column in range(6):
        _derive(J, dJ, column, moved)

    for leg in range(4):
        row, first = 1 + 3 * leg, 6 + 3 * leg
        # Joint axes, where the joints are, and the axes of the links behind them.
        c, s = np.cos(q[first + 1]), np.sin(q[first + 1])
        y1, z1 = (0.0, c, s), (0.0, -s, c)
        o1 = _point(links[row], x, y, z, (0.0, 0.0, 0.0))
        o2 = _point(links[row + 1], x, y1, z1, o1)
        x2, z2 = _turned(x, z1, q[first + 2])
        o3 = _point(links[row + 2], x2, y1, z2, o2)
        x3, z3 = _turned(x2, z2, q[first + 3])
        S1, S2, S3 = (
            (vector_product(o1, x), x),
            (vector_product(o2, y1), y1),
            (vector_product(o3, y1), y1),
        )

        rate1, rate2 = scaled(S1, v[first]), scaled(S2, v[first + 1])
        rate3 = scaled(S3, v[first + 2])
        v1 = added(velocity, rate1)
        v2 = added(v1, rate2)
        v3 = added(v2, rate3)
        a1 = added(lifted, motion_cross(v1, rate1))
        a2 = added(a1, motion_cross(v2, rate2))
        a3 = added(a2, motion_cross(v3, rate3))

        link1 = _inertia(links[row], x, y1, z1, o1)
        link2 = _inertia(links[row + 1], x2, y1, z2, o2)
        link3 = _inertia(links[row + 2], x3, y1, z3, o3)
        f3 = inertial_force(link3, v3, a3)
        f2 = added(f3, inertial_force(link2, v2, a2))
        f1 = added(f2, inertial_force(link1, v1, a1))
        force = added(force, f1)
        nle[first], nle[first + 1], nle[first + 2] = power(S1, f1), power(S2, f2), power(S3, f3)

        link2 = joined(link2, link3)
        link1 = joined(link1, link2)
        whole = joined(whole, link1)
        F1, F2, F3 = momentum_of(link1, S1), momentum_of(link2, S2), momentum_of(link3, S3)
        D1, D2, D3 = power(S1, F1), power(S2, F2), power(S3, F3)
        D_inverse = _inverse((D1, power(S1, F2), power(S1, F3), D2, power(S2, F3), D3))
        _eliminate(F1, F2, F3, D_inverse, leg, turn, reduced, M_inverse)

        for column, S, motion in ((first, S1, v1), (first + 1, S2, v2), (first + 2, S3, v3)):
            seen = to_world(R, position, S)
            _put(J, column, seen[0], seen[1])
            _derive(J, dJ, column, to_world(R, position, motion))

    for i in range(3):
        nle[i], nle[3 + i] = force[0][i], force[1][i]
    _close(whole, turn, reduced, M_inverse)


@compiled
def _eliminate(
    F1: Spatial,
    F2: Spatial,
    F3: Spatial,
    D_inverse: Symmetric,
    leg: int,
    turn: Array,
    reduced: Array,
    M_inverse: Array,
) -> None:
    """Fill F D⁻¹ of a leg and its D⁻¹, subtract F D⁻¹ Fᵀ from the trunk's block."""
    xx, xy, xz, yy, yz, zz = D_inverse
    first = 3 * leg
    for i in range(6):
        part, k = i // 3, i % 3
        a, b, c = F1[part][k], F2[part][k], F3[part][k]
        turn[i, first] = a * xx + b * xy + c * xz
        turn[i, first + 1] = a * xy + b * yy + c * yz
        turn[i, first + 2] = a * xz + b * yz + c * zz
        for j in range(i + 1):
            part, k = j // 3, j % 3
            reduced[i, j] -= (
                turn[i, first] * F1[part][k]
                + turn[i, first + 1] * F2[part][k]
                + turn[i, first + 2] * F3[part][k]
            )
    block = M_inverse[6 + first : 9 + first, 6 + first : 9 + first]
    block[0, 0], block[1, 1], block[2, 2] = xx, yy, zz
    block[0, 1], block[0, 2], block[1, 2] = xy, xz, yz
    block[1, 0], block[2, 0], block[2, 1] = xy, xz, yz


@compiled
def _close(whole: Inertia, turn: Array, reduced: Array, M_inverse: Array) -> None:
    """Complete M⁻¹ from the inertia of the whole robot and what `_eliminate` left."""
    mass, (hx, hy, hz), (xx, xy, xz, yy, yz, zz) = whole
    for i in range(3):
        reduced[i, i] += mass
    reduced[3, 1] -= hz
    reduced[3, 2] += hy
    reduced[4, 0] += hz
    reduced[4, 2] -= hx
    reduced[5, 0] -= hy
    reduced[5, 1] += hx
    reduced[3, 3] += xx
    reduced[4, 3] += xy
    reduced[5, 3] += xz
    reduced[4, 4] += yy
    reduced[5, 4] += yz
    reduced[5, 5] += zz
    trunk = np.eye(6)
    solve_factorised(factorise(reduced), trunk)
    coupled = product(trunk, turn)
    M_inverse[:6, :6] = trunk
    M_inverse[:6, 6:] = -coupled
    for i in range(12):
        for j in range(6):
            M_inverse[6 + i, j] = -coupled[j, i]
            for k in range(12):
                M_inverse[6 + i, 6 + k] += turn[j, i] * coupled[j, k]


@compiled
def _inertia(link: Array, x: Vector, y: Vector, z: Vector, origin: Vector) -> Inertia:
    """Of a link whose axes are x, y, z and whose frame is at `origin`."""
    mass, xx, xy, xz, yy, yz, zz = link[0], link[4], link[5], link[6], link[7], link[8], link[9]
    c = plus(origin, combined(link[1], x, link[2], y, link[3], z))
    h = (mass * c[0], mass * c[1], mass * c[2])
    # The moments about the link's centre: with I e = (xx x + xy y + xz z) and so on.
    u = combined(xx, x, xy, y, xz, z)
    v = combined(xy, x, yy, y, yz, z)
    w = combined(xz, x, yz, y, zz, z)
    return (
        mass,
        h,
        (
            u[0] * x[0] + v[0] * y[0] + w[0] * z[0] + h[1] * c[1] + h[2] * c[2],
            u[0] * x[1] + v[0] * y[1] + w[0] * z[1] - h[0] * c[1],
            u[0] * x[2] + v[0] * y[2] + w[0] * z[2] - h[0] * c[2],
            u[1] * x[1] + v[1] * y[1] + w[1] * z[1] + h[0] * c[0] + h[2] * c[2],
            u[1] * x[2] + v[1] * y[2] + w[1] * z[2] - h[1] * c[2],
            u[2] * x[2] + v[2] * y[2] + w[2] * z[2] + h[0] * c[0] + h[1] * c[1],
        ),
    )


@compiled
def _put(J: Array, column: int, linear: Vector, angular: Vector) -> None:
    for i in range(3):
        J[i, column], J[3 + i, column] = linear[i], angular[i]


@compiled
def _derive(J: Array, dJ: Array, column: int, motion: Spatial) -> None:
    """The derivative of a column of J that moves with `motion`."""
    linear = (J[0, column], J[1, column], J[2, column])
    angular = (J[3, column], J[4, column], J[5, column])
    changed = motion_cross(motion, (linear, angular))
    _put(dJ, column, changed[0], changed[1])


@compiled
def _inverse(a: Symmetric) -> Symmetric:
    """Of a symmetric 3×3 matrix."""
    xx, xy, xz, yy, yz, zz = a
    p, q, r = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d = 1.0 / (xx * p + xy * q + xz * r)
    return (
        d * p,
        d * q,
        d * r,
        d * (xx * zz - xz * xz),
        d * (xy * xz - xx * yz),
        d * (xx * yy - xy * xy),
    )


@compiled
def _point(link: Array, x: Vector, y: Vector, z: Vector, origin: Vector) -> Vector:
    """Where a link's joint is, on the link before with these axes and origin."""
    return plus(origin, combined(link[10], x, link[11], y, link[12], z))


@compiled
def _turned(x: Vector, z: Vector, angle: float) -> tuple[Vector, Vector]:
    """Both axes turned about the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    return (
        (c * x[0] - s * z[0], c * x[1] - s * z[1], c * x[2] - s * z[2]),
        (s * x[0] + c * z[0], s * x[1] + c * z[1], s * x[2] + c * z[2]),
    )
