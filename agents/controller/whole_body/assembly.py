"""From the rigid body's terms and a tick's goal to the reduced whole-body QP, see `problem`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadriga.agents.controller.maths.dense import (
    add_gram,
    cholesky,
    cholesky_solve,
    dot,
    product,
    symmetrise,
    times,
    transposed_times,
)
from quadriga.agents.controller.maths.rigid_body import RigidBodyTerms
from quadriga.agents.controller.maths.rotation import cross
from quadriga.agents.controller.whole_body.problem import Goal, Weights, WholeBodyProblem
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled


@compiled
def build(
    terms: RigidBodyTerms, R: Array, p_foot: Array, goal: Goal, weights: Weights, bounds: Array
) -> WholeBodyProblem:
    """Assemble the reduced QP at one instant; it holds NaN where no slip cannot be had.

    Args:
        terms: of the rigid body.
        R: trunk to odometry frame, (3, 3).
        p_foot: foot centres, (4, 3), m, odometry frame.
        goal: what is asked for.
        weights: of the QP.
        bounds: τ_min and τ_max of each motor, (2, 12), N·m.
    """
    on, off = _split_feet(terms, p_foot, goal)
    affine, acceleration = _resolve_contacts(terms, on)
    A, a0 = affine[:, :12].copy(), affine[:, 12].copy()
    outputs = _output_dynamics(terms.v, R, acceleration, off, goal.trunk)
    B, defect0 = outputs[:, :12].copy(), outputs[:, 12].copy()
    H, g = _cost(A, a0, outputs, on.desired, weights)
    C, c = _friction_cone(A, a0, weights)
    return WholeBodyProblem(H, g, C, c, A, a0, B, defect0, bounds[0], bounds[1])


class StackedFeet(NamedTuple):
    """Some of the feet, their coordinates one behind the other, 3 n in all.

    Attributes:
        J: Jacobian of their centres, (3 n, 18), odometry frame.
        drift: J̇ v, (3 n,), m/s².
        desired: forces of feet in contact, N, accelerations of the others, m/s², (3 n,).
    """

    J: Array
    drift: Array
    desired: Array


@compiled
def _split_feet(
    terms: RigidBodyTerms, p_foot: Array, goal: Goal
) -> tuple[StackedFeet, StackedFeet]:
    """The feet in contact and the others."""
    contact, _, swing, force = goal
    n_c = 0
    for leg in range(4):
        if contact[leg] > 0.5:
            n_c += 1
    n_on, n_off = 3 * n_c, 12 - 3 * n_c
    on = StackedFeet(np.zeros((n_on, 18)), np.zeros(n_on), np.zeros(n_on))
    off = StackedFeet(np.zeros((n_off, 18)), np.zeros(n_off), np.zeros(n_off))
    i_on, i_off = 0, 0
    for leg in range(4):
        if contact[leg] > 0.5:
            rows = slice(i_on, i_on + 3)
            _foot_jacobian(terms, p_foot[leg], leg, on.J[rows], on.drift[rows])
            on.desired[rows] = force[leg]
            i_on += 3
        else:
            rows = slice(i_off, i_off + 3)
            _foot_jacobian(terms, p_foot[leg], leg, off.J[rows], off.drift[rows])
            off.desired[rows] = swing[leg]
            i_off += 3
    return on, off


@compiled
def _foot_jacobian(
    terms: RigidBodyTerms, p: Array, leg: int, jacobian: Array, drift: Array
) -> None:
    """Fill the Jacobian (3, 18) and drift J̇v (3,) of one foot's centre at p, odometry frame."""
    J, dJ, v = terms.J, terms.dJ, terms.v
    bias = np.zeros(6)
    twist = np.zeros(6)
    jacobian[:, :] = 0.0
    for k in range(9):
        column = k if k < 6 else 3 * leg + k
        w = J[3:6, column]
        jacobian[0, column] = J[0, column] + w[1] * p[2] - w[2] * p[1]
        jacobian[1, column] = J[1, column] + w[2] * p[0] - w[0] * p[2]
        jacobian[2, column] = J[2, column] + w[0] * p[1] - w[1] * p[0]
        for row in range(6):
            bias[row] += dJ[row, column] * v[column]
            twist[row] += J[row, column] * v[column]
    velocity = twist[:3] + cross(twist[3:], p)
    drift[:] = bias[:3] + cross(bias[3:], p) + cross(twist[3:], velocity)


@compiled
def _resolve_contacts(terms: RigidBodyTerms, feet: StackedFeet) -> tuple[Array, Array]:
    """Contact forces and accelerations as functions of the torques where the feet do not slip.

    v̇ = M⁻¹ (S τ + J_cᵀ f − h) with J_c v̇ + J̇_c v = 0 gives f = A τ + a₀.

    Returns:
        (A, a₀), (3 n_c, 13), and v̇ of each torque and of none, (18, 13).
    """
    M_inverse, J_c = terms.M_inverse, feet.J
    n = len(J_c)
    free = times(M_inverse, terms.nle)
    J_c_M_inverse = product(J_c, M_inverse)  # its transpose is M⁻¹ J_cᵀ, M being symmetric
    affine = np.empty((n, 13))
    affine[:, :12] = -J_c_M_inverse[:, 6:]
    affine[:, 12] = times(J_c, free) - feet.drift
    Lambda_inverse = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            Lambda_inverse[i, j] = dot(J_c_M_inverse[i], J_c[j])
        Lambda_inverse[i, i] *= 1.0 + 1e-9
    cholesky_solve(cholesky(Lambda_inverse), affine)
    acceleration = np.empty((18, 13))
    for i in range(18):
        acceleration[i, :12] = M_inverse[i, 6:]
        acceleration[i, 12] = -free[i]
        for k in range(n):
            for j in range(13):
                acceleration[i, j] += J_c_M_inverse[k, i] * affine[k, j]
    return affine, acceleration


@compiled
def _output_dynamics(
    v: Array, R: Array, acceleration: Array, feet: StackedFeet, trunk: Array
) -> Array:
    """The outputs' accelerations of each torque, and of none less the desired ones.

    Args:
        v: generalised velocity, (18,).
        R: trunk to odometry frame, (3, 3).
        acceleration: v̇ of each torque and of none, (18, 13).
        feet: those not in contact.
        trunk: desired acceleration of the trunk, (6,).

    Returns:
        (B, b₀ − a_des), (18 − 3 n_c, 13).
    """
    outputs = np.empty((6 + len(feet.J), 13))
    outputs[:3] = product(R, acceleration[:3])
    outputs[3:6] = product(R, acceleration[3:6])
    outputs[6:] = product(feet.J, acceleration)
    outputs[:3, 12] += times(R, cross(v[3:6], v[:3])) - trunk[:3]
    outputs[3:6, 12] -= trunk[3:]
    outputs[6:, 12] += feet.drift - feet.desired
    return outputs


@compiled
def _cost(
    A: Array, a0: Array, outputs: Array, f_des: Array, weights: Weights
) -> tuple[Array, Array]:
    """H, (12, 12), and g, (12,), scaled so that the mean of H's diagonal is one.

    `outputs` are those of `_output_dynamics`; W is applied to them in place.
    """
    H = np.zeros((12, 12))
    add_gram(weights.gamma_force, A, H)
    outputs[3:6] *= weights.tilt_length
    outputs[6:] *= weights.swing_weight
    W_B, W_b = outputs[:, :12].copy(), outputs[:, 12].copy()
    add_gram(weights.gamma_defect, W_B, H)
    trace = 0.0
    for k in range(12):
        H[k, k] += weights.gamma_tau
        trace += H[k, k]
    symmetrise(H)
    g = weights.gamma_force * transposed_times(A, a0 - f_des)
    g = g + weights.gamma_defect * transposed_times(W_B, W_b)
    scale = 12.0 / trace
    return scale * H, scale * g


@compiled
def _friction_cone(A: Array, a0: Array, weights: Weights) -> tuple[Array, Array]:
    """Rows C τ ≥ c, (5 n_c, 12): the least normal force, and a pyramid inside the friction cone."""
    n_c = len(a0) // 3
    cone, force_min = weights.mu / np.sqrt(2.0), weights.force_min
    C, c = np.empty((5 * n_c, 12)), np.empty(5 * n_c)
    for i in range(n_c):
        row = 5 * i
        x0, y0, z0 = a0[3 * i], a0[3 * i + 1], a0[3 * i + 2]
        c[row] = force_min - z0
        c[row + 1], c[row + 2] = x0 - cone * z0, -x0 - cone * z0
        c[row + 3], c[row + 4] = y0 - cone * z0, -y0 - cone * z0
        for k in range(12):  # no arithmetic of rows, which would allocate each of them
            x, y, z = A[3 * i, k], A[3 * i + 1, k], A[3 * i + 2, k]
            C[row, k] = z
            C[row + 1, k], C[row + 2, k] = cone * z - x, cone * z + x
            C[row + 3, k], C[row + 4, k] = cone * z - y, cone * z + y
    return C, c
