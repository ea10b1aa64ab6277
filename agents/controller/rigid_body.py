"""The rigid-body terms of a trunk with four legs of three joints, and loops over small matrices.

A general library is made for any robot and called once for each term; with cold caches that cost
nearly as much as the rest of the whole-body QP. Here everything is a spatial vector about the
trunk's origin, in the trunk's frame (recursive Newton-Euler and composite rigid bodies:
Featherstone, Rigid Body Dynamics Algorithms, 2008). Legs act on each other through the trunk alone,
so M⁻¹ comes from four 3×3 blocks and one Schur complement of 6×6.

Matrices of a dozen rows are multiplied and solved by loops: at these sizes a call of BLAS costs
more than its arithmetic, most of all when its code and buffers have left the caches; and loops give
the same bits on every processor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadriga.agents.estimator.kinematics import rotation_matrix
from quadriga.agents.estimator.leg_dynamics import (
    ROTOR,
    ZERO,
    Inertia,
    LegState,
    Spatial,
    Symmetric,
    Vector,
    X,
    Y,
    Z,
    add_spatial,
    combine_inertias,
    inertial_force,
    leg_state,
    link_inertia,
    momentum_of,
    motion_cross,
    power,
    to_world,
    vector_product,
)
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled


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
    gravity = ((GRAVITY * R[2, 0], GRAVITY * R[2, 1], GRAVITY * R[2, 2]), ZERO)
    _fill_trunk_columns(R, position, velocity, J, dJ)
    whole = link_inertia(links[0], X, Y, Z, ZERO)
    force = inertial_force(whole, velocity, gravity)
    reaction = np.zeros((6, 12))  # F D⁻¹: what the trunk feels of the legs' joints
    reduced = np.zeros((6, 6))
    for leg in range(4):
        first = 6 + 3 * leg
        rows, rates = links[1 + 3 * leg : 4 + 3 * leg], v[first : first + 3]
        state = leg_state(rows, q[7 + 3 * leg : 10 + 3 * leg], rates, velocity, gravity)
        force = add_spatial(force, state.force[0])
        whole = combine_inertias(whole, state.inertia[0])
        (S1, S2, S3), (v1, v2, v3) = state.axes, state.velocity
        f1, f2, f3 = state.force
        nle[first], nle[first + 1], nle[first + 2] = power(S1, f1), power(S2, f2), power(S3, f3)
        _eliminate(state, rows, leg, reaction, reduced, M_inverse)
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
        _set_column(J, column, axis, ZERO)
        _set_column(J, 3 + column, vector_product(position, axis), axis)
    motion = to_world(R, position, velocity)
    for column in range(6):
        _differentiate_column(J, dJ, column, motion)


@compiled
def _eliminate(
    state: LegState, links: Array, leg: int, reaction: Array, reduced: Array, M_inverse: Array
) -> None:
    """Fill F D⁻¹ of a leg and its D⁻¹, subtract F D⁻¹ Fᵀ from the trunk's block.

    F is the momentum that unit rates of the joints give the leg, D = Sᵀ F + diag(rotors): a rotor
    turns its gear's ratio faster than its joint, so that only its own joint feels its inertia.
    """
    (S1, S2, S3), (link1, link2, link3) = state.axes, state.inertia
    F1, F2, F3 = momentum_of(link1, S1), momentum_of(link2, S2), momentum_of(link3, S3)
    D1 = power(S1, F1) + links[0][ROTOR]
    D2 = power(S2, F2) + links[1][ROTOR]
    D3 = power(S3, F3) + links[2][ROTOR]
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
def dot(x: Array, y: Array) -> float:
    """xᵀ y. Shapes (k,), (k,)."""
    total = 0.0
    for k in range(len(x)):
        total += x[k] * y[k]
    return total


@compiled
def times(A: Array, x: Array) -> Array:
    """A x. Shapes (m, k), (k,)."""
    y = np.zeros(A.shape[0])
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            y[i] += A[i, k] * x[k]
    return y


@compiled
def transposed_times(A: Array, x: Array) -> Array:
    """Aᵀ x. Shapes (k, m), (k,)."""
    y = np.zeros(A.shape[1])
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            y[i] += A[k, i] * x[k]
    return y


@compiled
def product(A: Array, B: Array) -> Array:
    """A B. Shapes (m, k), (k, n)."""
    C = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            a = A[i, k]
            for j in range(B.shape[1]):
                C[i, j] += a * B[k, j]
    return C


@compiled
def add_gram(weight: float, A: Array, H: Array) -> None:
    """Add weight · Aᵀ A to the lower triangle of H. Shapes (k, n), (n, n)."""
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            a = weight * A[k, i]
            for j in range(i + 1):
                H[i, j] += a * A[k, j]


@compiled
def symmetrise(H: Array) -> None:
    """Copy the lower triangle of H to the upper one."""
    for i in range(H.shape[0]):
        for j in range(i):
            H[j, i] = H[i, j]


@compiled
def cholesky(H: Array) -> Array:
    """The lower Cholesky factor of H, (n, n), of which the lower triangle is read.

    NaN where H is not positive definite.
    """
    n = H.shape[0]
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                L[i, i] = np.sqrt(total) if total > 0.0 else np.nan
            else:
                L[i, j] = total / L[j, j]
    return L


@compiled
def cholesky_solve(L: Array, B: Array) -> None:
    """Replace B, (n, m), by (L Lᵀ)⁻¹ B."""
    n, m = B.shape
    for i in range(n):
        for k in range(i):
            for j in range(m):
                B[i, j] -= L[i, k] * B[k, j]
        for j in range(m):
            B[i, j] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            for j in range(m):
                B[i, j] -= L[k, i] * B[k, j]
        for j in range(m):
            B[i, j] /= L[i, i]
