"""The rigid-body terms of a trunk with four legs of three joints, as one compiled function.

A general library is made for any robot and called once for each term; with cold caches that cost
nearly as much as the rest of the whole-body QP. Here everything is a spatial vector about the
trunk's origin, in the trunk's frame (recursive Newton-Euler and composite rigid bodies:
Featherstone, Rigid Body Dynamics Algorithms, 2008). Legs act on each other through the trunk alone,
so M⁻¹ comes from four 3×3 blocks and one Schur complement of 6×6.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from quadriga.agents.controller.maths.dense import cholesky, cholesky_solve, product
from quadriga.agents.controller.maths.rotation import rotation_matrix
from quadriga.agents.controller.maths.spatial import (
    Inertia,
    Spatial,
    Symmetric,
    Vector,
    add_spatial,
    add_vectors,
    combine_inertias,
    inertial_force,
    linear_combination,
    momentum_of,
    motion_cross,
    power,
    scale,
    to_world,
    vector_product,
)
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.a1 import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_JOINTS: Final = ("JointModelFreeFlyer", *4 * ("JointModelRX", "JointModelRY", "JointModelRY"))
N_LINKS: Final = 13  # the trunk and three of each leg
N_LINK_NUMBERS: Final = 13  # of each, see `link_table`
_X: Final = (1.0, 0.0, 0.0)
_Y: Final = (0.0, 1.0, 0.0)
_Z: Final = (0.0, 0.0, 1.0)
_ZERO: Final = (0.0, 0.0, 0.0)


def link_table(model: pin.Model) -> Array:
    """What `rigid_body_terms` knows of the trunk and the twelve links. Shape (13, 13).

    Columns: mass, kg; centre of mass (3), m; moments about it xx, xy, xz, yy, yz, zz, kg·m²;
    where the link's joint is on the link before (3), m.

    Raises:
        ConfigError: the model is not a trunk with four legs whose joints turn about x, y and y.
    """
    joints = tuple(joint.shortname() for joint in list(model.joints)[1:])
    places, inertias = list(model.jointPlacements)[1:], list(model.inertias)[1:]
    rotated = [place for place in places if not np.array_equal(place.rotation, np.eye(3))]
    if joints != _JOINTS or rotated:
        raise ConfigError(
            "robot",
            f"joints {', '.join(joints)}, {len(rotated)} of them mounted at an angle",
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


class RigidBodyTerms(NamedTuple):
    """Terms of M(q) v̇ + h(q, v) = S τ + Jᵀ f at one instant (Pinocchio's coordinates).

    Attributes:
        M_inverse: inverse mass matrix, (18, 18).
        nle: Coriolis, centrifugal and gravity terms h, (18,).
        J: spatial Jacobians of all joints, world frame, (6, 18), linear rows first.
        dJ: its time derivative, (6, 18).
        v: generalised velocity; the trunk's in the trunk frame, (18,).
    """

    M_inverse: Array
    nle: Array
    J: Array
    dJ: Array
    v: Array


class LegState(NamedTuple):
    """A leg's three links at one instant, from the hip on, about the trunk's origin in its frame.

    Attributes:
        axes: motion of each link at unit rate of its joint.
        velocity: of each link.
        force: that accelerates each link and what it carries while no joint accelerates.
        inertia: of each link and what it carries.
    """

    axes: tuple[Spatial, Spatial, Spatial]
    velocity: tuple[Spatial, Spatial, Spatial]
    force: tuple[Spatial, Spatial, Spatial]
    inertia: tuple[Inertia, Inertia, Inertia]


@compiled
def rigid_body_terms(q: Array, v: Array, links: Array) -> RigidBodyTerms:
    """The terms of the equation of motion.

    Args:
        q: Pinocchio's configuration, (19,), its quaternion normalised.
        v: Pinocchio's velocity, (18,).
        links: `link_table`.
    """
    M_inverse, nle = np.zeros((18, 18)), np.empty(18)
    J, dJ = np.empty((6, 18)), np.empty((6, 18))
    R = rotation_matrix(np.array([q[6], q[3], q[4], q[5]]))
    position = (q[0], q[1], q[2])
    velocity = ((v[0], v[1], v[2]), (v[3], v[4], v[5]))
    # Gravity is an acceleration of the whole frame upwards.
    gravity = ((GRAVITY * R[2, 0], GRAVITY * R[2, 1], GRAVITY * R[2, 2]), _ZERO)
    _fill_trunk_columns(R, position, velocity, J, dJ)
    whole = _inertia(links[0], _X, _Y, _Z, _ZERO)
    force = inertial_force(whole, velocity, gravity)
    reaction = np.zeros((6, 12))  # F D⁻¹: what the trunk feels of the legs' joints
    reduced = np.zeros((6, 6))
    for leg in range(4):
        first = 6 + 3 * leg
        rows, rates = links[1 + 3 * leg : 4 + 3 * leg], v[first : first + 3]
        state = _leg(rows, q[7 + 3 * leg : 10 + 3 * leg], rates, velocity, gravity)
        force = add_spatial(force, state.force[0])
        whole = combine_inertias(whole, state.inertia[0])
        (S1, S2, S3), (v1, v2, v3) = state.axes, state.velocity
        f1, f2, f3 = state.force
        nle[first], nle[first + 1], nle[first + 2] = power(S1, f1), power(S2, f2), power(S3, f3)
        _eliminate(state, leg, reaction, reduced, M_inverse)
        for column, S, motion in ((first, S1, v1), (first + 1, S2, v2), (first + 2, S3, v3)):
            linear, angular = to_world(R, position, S)
            _set_column(J, column, linear, angular)
            _differentiate_column(J, dJ, column, to_world(R, position, motion))
    for i in range(3):
        nle[i], nle[3 + i] = force[0][i], force[1][i]
    _complete_inverse(whole, reaction, reduced, M_inverse)
    return RigidBodyTerms(M_inverse, nle, J, dJ, v)


@compiled
def _fill_trunk_columns(R: Array, position: Vector, velocity: Spatial, J: Array, dJ: Array) -> None:
    """The trunk's six columns of J and its derivative."""
    for column in range(3):
        axis = (R[0, column], R[1, column], R[2, column])
        _set_column(J, column, axis, _ZERO)
        _set_column(J, 3 + column, vector_product(position, axis), axis)
    motion = to_world(R, position, velocity)
    for column in range(6):
        _differentiate_column(J, dJ, column, motion)


@compiled
def _leg(links: Array, q: Array, rates: Array, trunk: Spatial, gravity: Spatial) -> LegState:
    """The state of a leg, by recursive Newton-Euler and composite rigid bodies.

    Args:
        links: its rows of `link_table`, (3, 13).
        q: its joint angles, (3,), rad.
        rates: its joint rates, (3,), rad/s.
        trunk: motion of the trunk.
        gravity: the acceleration that stands for it.
    """
    # Joint axes, where the joints are, and the axes of the links behind them.
    c, s = np.cos(q[0]), np.sin(q[0])
    y1, z1 = (0.0, c, s), (0.0, -s, c)
    o1 = _joint_position(links[0], _X, _Y, _Z, _ZERO)
    o2 = _joint_position(links[1], _X, y1, z1, o1)
    x2, z2 = _rotate_about_y(_X, z1, q[1])
    o3 = _joint_position(links[2], x2, y1, z2, o2)
    x3, z3 = _rotate_about_y(x2, z2, q[2])
    S1, S2, S3 = (
        (vector_product(o1, _X), _X),
        (vector_product(o2, y1), y1),
        (vector_product(o3, y1), y1),
    )

    rate1, rate2, rate3 = scale(S1, rates[0]), scale(S2, rates[1]), scale(S3, rates[2])
    v1 = add_spatial(trunk, rate1)
    v2 = add_spatial(v1, rate2)
    v3 = add_spatial(v2, rate3)
    a1 = add_spatial(gravity, motion_cross(v1, rate1))
    a2 = add_spatial(a1, motion_cross(v2, rate2))
    a3 = add_spatial(a2, motion_cross(v3, rate3))

    link1 = _inertia(links[0], _X, y1, z1, o1)
    link2 = _inertia(links[1], x2, y1, z2, o2)
    link3 = _inertia(links[2], x3, y1, z3, o3)
    f3 = inertial_force(link3, v3, a3)
    f2 = add_spatial(f3, inertial_force(link2, v2, a2))
    f1 = add_spatial(f2, inertial_force(link1, v1, a1))
    link2 = combine_inertias(link2, link3)
    link1 = combine_inertias(link1, link2)
    return LegState((S1, S2, S3), (v1, v2, v3), (f1, f2, f3), (link1, link2, link3))


@compiled
def _eliminate(
    state: LegState, leg: int, reaction: Array, reduced: Array, M_inverse: Array
) -> None:
    """Fill F D⁻¹ of a leg and its D⁻¹, subtract F D⁻¹ Fᵀ from the trunk's block.

    F is the momentum that unit rates of the joints give the leg, D = Sᵀ F.
    """
    (S1, S2, S3), (link1, link2, link3) = state.axes, state.inertia
    F1, F2, F3 = momentum_of(link1, S1), momentum_of(link2, S2), momentum_of(link3, S3)
    D1, D2, D3 = power(S1, F1), power(S2, F2), power(S3, F3)
    D = (D1, power(S1, F2), power(S1, F3), D2, power(S2, F3), D3)
    xx, xy, xz, yy, yz, zz = _inverse(D)
    first = 3 * leg
    for i in range(6):
        part, k = i // 3, i % 3
        a, b, c = F1[part][k], F2[part][k], F3[part][k]
        reaction[i, first] = a * xx + b * xy + c * xz
        reaction[i, first + 1] = a * xy + b * yy + c * yz
        reaction[i, first + 2] = a * xz + b * yz + c * zz
        for j in range(i + 1):
            part, k = j // 3, j % 3
            reduced[i, j] -= (
                reaction[i, first] * F1[part][k]
                + reaction[i, first + 1] * F2[part][k]
                + reaction[i, first + 2] * F3[part][k]
            )
    block = M_inverse[6 + first : 9 + first, 6 + first : 9 + first]
    block[0, 0], block[1, 1], block[2, 2] = xx, yy, zz
    block[0, 1], block[0, 2], block[1, 2] = xy, xz, yz
    block[1, 0], block[2, 0], block[2, 1] = xy, xz, yz


@compiled
def _complete_inverse(whole: Inertia, reaction: Array, reduced: Array, M_inverse: Array) -> None:
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
    cholesky_solve(cholesky(reduced), trunk)
    coupled = product(trunk, reaction)
    M_inverse[:6, :6] = trunk
    M_inverse[:6, 6:] = -coupled
    for i in range(12):
        for j in range(6):
            M_inverse[6 + i, j] = -coupled[j, i]
            for k in range(12):
                M_inverse[6 + i, 6 + k] += reaction[j, i] * coupled[j, k]


@compiled
def _inertia(link: Array, x: Vector, y: Vector, z: Vector, origin: Vector) -> Inertia:
    """Of a link whose axes are x, y, z and whose frame is at `origin`."""
    mass, xx, xy, xz, yy, yz, zz = link[0], link[4], link[5], link[6], link[7], link[8], link[9]
    c = add_vectors(origin, linear_combination(link[1], x, link[2], y, link[3], z))
    h = (mass * c[0], mass * c[1], mass * c[2])
    # The moments about the link's centre: with I e = (xx x + xy y + xz z) and so on.
    u = linear_combination(xx, x, xy, y, xz, z)
    v = linear_combination(xy, x, yy, y, yz, z)
    w = linear_combination(xz, x, yz, y, zz, z)
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
def _set_column(J: Array, column: int, linear: Vector, angular: Vector) -> None:
    for i in range(3):
        J[i, column], J[3 + i, column] = linear[i], angular[i]


@compiled
def _differentiate_column(J: Array, dJ: Array, column: int, motion: Spatial) -> None:
    """The derivative of a column of J that moves with `motion`."""
    linear = (J[0, column], J[1, column], J[2, column])
    angular = (J[3, column], J[4, column], J[5, column])
    derivative = motion_cross(motion, (linear, angular))
    _set_column(dJ, column, derivative[0], derivative[1])


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
def _joint_position(link: Array, x: Vector, y: Vector, z: Vector, origin: Vector) -> Vector:
    """Where a link's joint is, on the link before with these axes and origin."""
    return add_vectors(origin, linear_combination(link[10], x, link[11], y, link[12], z))


@compiled
def _rotate_about_y(x: Vector, z: Vector, angle: float) -> tuple[Vector, Vector]:
    """Both axes turned about the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    return (
        (c * x[0] - s * z[0], c * x[1] - s * z[1], c * x[2] - s * z[2]),
        (s * x[0] + c * z[0], s * x[1] + c * z[1], s * x[2] + c * z[2]),
    )
