"""The whole-body QP (the paper's low-level controller), reduced to the twelve torques.

min  γ₁/2 |τ|² + γ₂/2 |f − f_des|² + γ₃/2 |W δ|²
s.t. ḧ(τ, f) = a_des + δ   (output dynamics: trunk and swing feet; a_des holds −K_P h − K_D ḣ)
     r̈(τ, f) = 0           (no slip of the feet in contact)
     |τ| ≤ τ_max,  f in the friction cone

W = diag(1, 1, 1, ℓ, ℓ, ℓ, s, s, …) says what a rad/s² of the trunk and a m/s² of a swing foot weigh
against a m/s² of the trunk (the paper: ℓ = 1 m, s = 1).

No slip makes the forces affine in the torques, f = A τ + a₀, and with them the outputs,
ḧ = B τ + b₀: twelve variables, a box and five rows per foot in contact remain.
"""

from __future__ import annotations

from typing import Final

import daqp
import numpy as np

from quadriga.agents.controller.maths.dense import (
    add_gram,
    factorise,
    mirror,
    product,
    solve_factorised,
    times,
    transposed_times,
)
from quadriga.agents.controller.maths.rotation import cross
from quadriga.agents.controller.model import Terms
from quadriga.shared.robot.a1 import TORQUE_LIMIT, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record

UNCONSTRAINED: Final = "unconstrained"
MU: Final = 3  # place of the friction coefficient in `Weights.as_array`
_TOLERANCE = 1e-9


@record
class Goal:
    """What one tick asks of the QP (odometry frame).

    Attributes:
        contact: 1 for the feet that may push, (4,).
        trunk: desired linear and angular acceleration of the trunk, (6,), m/s², rad/s².
        swing: desired acceleration of the feet not in contact, (4, 3), m/s².
        force: desired contact forces f_des, (4, 3), N.
    """

    contact: Array
    trunk: Array
    swing: Array
    force: Array


@record
class Weights:
    """γ₁, γ₂, γ₃ of the cost, friction coefficient and least normal force of the cone; ℓ and s."""

    gamma_tau: float
    gamma_force: float
    gamma_defect: float
    mu: float
    force_min: float
    tilt_length: float = 1.0
    swing_weight: float = 1.0

    def as_array(self) -> Array:
        """As the compiled assembly takes them. Shape (7,)."""
        return np.array(
            [
                self.gamma_tau,
                self.gamma_force,
                self.gamma_defect,
                self.mu,
                self.force_min,
                self.tilt_length,
                self.swing_weight,
            ]
        )


@record
class WholeBodyProblem:
    """min ½ τᵀ H τ + gᵀ τ  s.t. |τ| ≤ τ_max, C τ ≥ c; the forces are f = A τ + a₀."""

    H: Array
    g: Array
    C: Array
    c: Array
    A: Array
    a0: Array
    B: Array
    defect0: Array


@record
class WholeBodySolution:
    """What came of the QP and how.

    Attributes:
        x: torques (12), forces (12), defect (6 + 3 for each foot not in contact), the rest zero.
        status: "unconstrained" (closed form), "constrained" (active set) or, with no torques and
            the rest of no use, "infeasible:<solver's flag>" or "infeasible:singular".
        rows: length of the defect.
    """

    x: Array
    status: str
    rows: int = 18

    @property
    def tau(self) -> Array:
        """Torques, (12,), N·m."""
        return self.x[:12]

    @property
    def force(self) -> Array:
        """Contact forces, (4, 3), N, odometry frame."""
        return self.x[12:24].reshape(4, 3)

    @property
    def defect(self) -> Array:
        """What the accelerations miss of the desired ones: δ."""
        return self.x[24 : 24 + self.rows]

    @property
    def solved(self) -> bool:
        """Whether the torques may be used."""
        return not self.status.startswith("infeasible")


def solve_goal(
    terms: Terms, R: Array, p_foot: Array, goal: Goal, weights: Weights
) -> WholeBodySolution:
    """Build, solve, unpack; numbers beyond all bounds or a singular problem are no solution."""
    problem = build(terms, R, p_foot, goal, weights)
    return unpack(problem, goal.contact, *solve(problem))


def build(terms: Terms, R: Array, p_foot: Array, goal: Goal, weights: Weights) -> WholeBodyProblem:
    """Assemble the reduced QP at one instant."""
    return WholeBodyProblem(
        *_assemble(
            terms.M_inverse,
            terms.nle,
            terms.J,
            terms.dJ,
            terms.v,
            R,
            p_foot,
            goal.contact,
            goal.trunk,
            goal.swing,
            goal.force,
            weights.as_array(),
        )
    )


def solve(problem: WholeBodyProblem) -> tuple[Array, str]:
    """The optimal torques and the status; the closed form where no limit is active."""
    tau, feasible = _unconstrained(problem.H, problem.g, problem.C, problem.c, TORQUE_LIMIT)
    if feasible:
        return tau, UNCONSTRAINED
    if not np.isfinite(tau).all():
        return np.zeros(12), "infeasible:singular"
    rows = len(problem.c)
    upper = np.full(12 + rows, 1e30)
    lower = np.empty(12 + rows)
    upper[:12] = TORQUE_LIMIT
    lower[:12] = -TORQUE_LIMIT
    lower[12:] = problem.c
    tau, _, flag, _ = daqp.solve(
        problem.H, problem.g, problem.C, upper, lower, np.zeros(12 + rows, dtype=np.intc)
    )
    if flag != 1 or not np.isfinite(tau).all():
        return np.zeros(12), f"infeasible:{flag}"
    return np.clip(tau, -TORQUE_LIMIT, TORQUE_LIMIT), "constrained"


def unpack(problem: WholeBodyProblem, contact: Array, tau: Array, status: str) -> WholeBodySolution:
    """Forces and defect that the torques imply."""
    x = np.zeros(42)
    _imply(problem.A, problem.a0, problem.B, problem.defect0, contact, tau, x)
    return WholeBodySolution(x, status, len(problem.defect0))


@compiled
def _imply(
    A: Array, a0: Array, B: Array, defect0: Array, contact: Array, tau: Array, x: Array
) -> None:
    """Fill torques, forces and defect, see `WholeBodySolution`."""
    x[:12] = tau
    row = 0
    for leg in range(4):
        if contact[leg] > 0.5:
            x[12 + 3 * leg : 15 + 3 * leg] = times(A[row : row + 3], tau) + a0[row : row + 3]
            row += 3
    x[24 : 24 + len(defect0)] = times(B, tau) + defect0


@compiled
def _unconstrained(H: Array, g: Array, C: Array, c: Array, limit: float) -> tuple[Array, bool]:
    """The minimiser without limits, and whether it keeps them; NaN of a singular problem."""
    step = np.negative(g).reshape(12, 1)
    solve_factorised(factorise(H), step)
    tau = step[:, 0].copy()
    feasible = bool(np.all(np.abs(tau) <= limit))
    for row in range(C.shape[0]):
        total = 0.0
        for k in range(12):
            total += C[row, k] * tau[k]
        if not total >= c[row] - _TOLERANCE:
            feasible = False
    return tau, feasible


@compiled
def _foot_jacobian(
    J: Array, dJ: Array, v: Array, p: Array, leg: int, jacobian: Array, drift: Array
) -> None:
    """Fill the Jacobian (3, 18) and drift J̇v (3,) of one foot's centre at p, world frame."""
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
def _assemble(
    M_inverse: Array,
    nle: Array,
    J: Array,
    dJ: Array,
    v: Array,
    R: Array,
    p_foot: Array,
    contact: Array,
    trunk: Array,
    swing: Array,
    force: Array,
    weights: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
    """H, g, C, c, A, a₀, B, b₀ − a_des of `WholeBodyProblem`; NaN where no slip cannot be had."""
    gamma_tau, gamma_force, gamma_defect, mu, force_min, tilt_length, swing_weight = weights
    n_c = 0
    for leg in range(4):
        if contact[leg] > 0.5:
            n_c += 1
    J_c, J_s = np.zeros((3 * n_c, 18)), np.zeros((12 - 3 * n_c, 18))
    drift_c, drift_s = np.zeros(3 * n_c), np.zeros(12 - 3 * n_c)
    f_des, a_swing = np.zeros(3 * n_c), np.zeros(12 - 3 * n_c)
    i_c, i_s = 0, 0
    for leg in range(4):
        if contact[leg] > 0.5:
            _foot_jacobian(J, dJ, v, p_foot[leg], leg, J_c[i_c : i_c + 3], drift_c[i_c : i_c + 3])
            f_des[i_c : i_c + 3] = force[leg]
            i_c += 3
        else:
            _foot_jacobian(J, dJ, v, p_foot[leg], leg, J_s[i_s : i_s + 3], drift_s[i_s : i_s + 3])
            a_swing[i_s : i_s + 3] = swing[leg]
            i_s += 3

    # v̇ = M⁻¹ (S τ + J_cᵀ f − h) with J_c v̇ + J̇_c v = 0 gives f = A τ + a₀.
    free = times(M_inverse, nle)
    reaction = product(J_c, M_inverse)  # its transpose is M⁻¹ J_cᵀ, M being symmetric
    affine = np.empty((3 * n_c, 13))
    affine[:, :12] = -reaction[:, 6:]
    affine[:, 12] = times(J_c, free) - drift_c
    Lambda_inverse = np.empty((3 * n_c, 3 * n_c))
    for i in range(3 * n_c):
        for j in range(i + 1):
            Lambda_inverse[i, j] = np.sum(reaction[i] * J_c[j])
        Lambda_inverse[i, i] *= 1.0 + 1e-9
    solve_factorised(factorise(Lambda_inverse), affine)
    acceleration = np.empty((18, 13))  # v̇ of each torque, and of none
    for i in range(18):
        acceleration[i, :12] = M_inverse[i, 6:]
        acceleration[i, 12] = -free[i]
        for k in range(3 * n_c):
            for j in range(13):
                acceleration[i, j] += reaction[k, i] * affine[k, j]
    A, a0 = affine[:, :12].copy(), affine[:, 12].copy()

    outputs = np.empty((18 - 3 * n_c, 13))
    outputs[:3] = product(R, acceleration[:3])
    outputs[3:6] = product(R, acceleration[3:6])
    outputs[6:] = product(J_s, acceleration)
    outputs[:3, 12] += times(R, cross(v[3:6], v[:3])) - trunk[:3]
    outputs[3:6, 12] -= trunk[3:]
    outputs[6:, 12] += drift_s - a_swing
    B, b = outputs[:, :12].copy(), outputs[:, 12].copy()

    H = np.zeros((12, 12))
    add_gram(gamma_force, A, H)
    outputs[3:6] *= tilt_length
    outputs[6:] *= swing_weight
    W_B, W_b = outputs[:, :12].copy(), outputs[:, 12].copy()
    add_gram(gamma_defect, W_B, H)
    trace = 0.0
    for k in range(12):
        H[k, k] += gamma_tau
        trace += H[k, k]
    mirror(H)
    g = gamma_force * transposed_times(A, a0 - f_des) + gamma_defect * transposed_times(W_B, W_b)
    scale = 12.0 / trace

    cone = mu / np.sqrt(2.0)
    C, c = np.empty((5 * n_c, 12)), np.empty(5 * n_c)
    for i in range(n_c):
        x, y, z = A[3 * i], A[3 * i + 1], A[3 * i + 2]
        x0, y0, z0 = a0[3 * i], a0[3 * i + 1], a0[3 * i + 2]
        C[5 * i], c[5 * i] = z, force_min - z0
        C[5 * i + 1], c[5 * i + 1] = cone * z - x, x0 - cone * z0
        C[5 * i + 2], c[5 * i + 2] = cone * z + x, -x0 - cone * z0
        C[5 * i + 3], c[5 * i + 3] = cone * z - y, y0 - cone * z0
        C[5 * i + 4], c[5 * i + 4] = cone * z + y, -y0 - cone * z0
    return scale * H, scale * g, C, c, A, a0, B, b


@compiled
def closed_form(
    M_inverse: Array,
    nle: Array,
    J: Array,
    dJ: Array,
    v: Array,
    R: Array,
    p_foot: Array,
    contact: Array,
    trunk: Array,
    swing: Array,
    force: Array,
    weights: Array,
    x: Array,
) -> int:
    """Fill `x`, see `WholeBodySolution`, with the optimum without limits.

    Returns its rows, 0 if it breaks any.
    """
    H, g, C, c, A, a0, B, defect0 = _assemble(
        M_inverse, nle, J, dJ, v, R, p_foot, contact, trunk, swing, force, weights
    )
    tau, feasible = _unconstrained(H, g, C, c, TORQUE_LIMIT)
    _imply(A, a0, B, defect0, contact, tau, x)
    return len(defect0) if feasible else 0
