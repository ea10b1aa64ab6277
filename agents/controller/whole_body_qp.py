"""The whole-body QP (the paper's low-level controller), reduced to the twelve torques.

min  γ₁/2 |τ|² + γ₂/2 |f − f_des|² + γ₃/2 |δ|²
s.t. ḧ(τ, f) = a_des + δ   (output dynamics: trunk and swing feet; a_des holds −K_P h − K_D ḣ)
     r̈(τ, f) = 0           (no slip of the feet in contact)
     |τ| ≤ τ_max,  f in the friction cone

No slip makes the forces affine in the torques, f = A τ + a₀, and with them the outputs,
ḧ = B τ + b₀: twelve variables, a box and five rows per foot in contact remain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import daqp
import numpy as np

from agents.controller.model import Terms
from agents.controller.rotation import cross
from shared.jit import compiled
from shared.robot import TORQUE_LIMIT, Array

UNCONSTRAINED: Final = "unconstrained"
_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Weights:
    """γ₁, γ₂, γ₃ of the cost, friction coefficient and least normal force of the cone."""

    gamma_tau: float
    gamma_force: float
    gamma_defect: float
    mu: float
    force_min: float


@dataclass(frozen=True, slots=True)
class Problem:
    """min ½ τᵀ H τ + gᵀ τ  s.t. |τ| ≤ τ_max, C τ ≥ c; the forces are f = A τ + a₀."""

    H: Array
    g: Array
    C: Array
    c: Array
    A: Array
    a0: Array
    B: Array
    defect0: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """Torques (12,) N·m, forces (4, 3) N, defect δ, and how they were obtained.

    `status` is "unconstrained" (closed form), "constrained" (active set) or, with `tau` zero,
    "infeasible:<solver's flag>" or "infeasible:singular".
    """

    tau: Array
    force: Array
    defect: Array
    status: str

    @property
    def solved(self) -> bool:
        """Whether the torques may be used."""
        return not self.status.startswith("infeasible")


def solve_goal(terms: Terms, R: Array, p_foot: Array, goal: Goal, weights: Weights) -> Solution:
    """Build, solve, unpack; numbers beyond all bounds or a singular problem are no solution.

    Where no limit is active, as at most ticks, all of it is one compiled call.
    """
    try:
        x, n_h, free = _closed_form(*_arguments(terms, R, p_foot, goal, weights))
        if free:
            return Solution(x[:12], x[12:24].reshape(4, 3), x[24 : 24 + n_h], UNCONSTRAINED)
        problem = build(terms, R, p_foot, goal, weights)
        return unpack(problem, goal.contact, *solve(problem))
    except np.linalg.LinAlgError:
        return Solution(np.zeros(12), np.zeros((4, 3)), np.zeros(18), "infeasible:singular")


def build(terms: Terms, R: Array, p_foot: Array, goal: Goal, weights: Weights) -> Problem:
    """Assemble the reduced QP at one instant."""
    return Problem(*_assemble(*_arguments(terms, R, p_foot, goal, weights)))


def _arguments(
    terms: Terms, R: Array, p_foot: Array, goal: Goal, weights: Weights
) -> tuple[Any, ...]:
    return (
        terms.M_inverse, terms.nle, terms.J, terms.dJ, terms.v, R, p_foot,
        goal.contact, goal.trunk, goal.swing, goal.force,
        weights.gamma_tau, weights.gamma_force, weights.gamma_defect,
        weights.mu, weights.force_min,
    )  # fmt: skip


def solve(problem: Problem) -> tuple[Array, str]:
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


def unpack(problem: Problem, contact: Array, tau: Array, status: str) -> Solution:
    """Forces and defect that the torques imply."""
    force, defect = _implied(problem.A, problem.a0, problem.B, problem.defect0, contact, tau)
    return Solution(tau, force, defect, status)


@compiled
def _implied(
    A: Array, a0: Array, B: Array, defect0: Array, contact: Array, tau: Array
) -> tuple[Array, Array]:
    force = np.zeros((4, 3))
    stacked = A @ tau + a0
    row = 0
    for leg in range(4):
        if contact[leg] > 0.5:
            force[leg] = stacked[row : row + 3]
            row += 3
    return force, B @ tau + defect0


@compiled
def _unconstrained(H: Array, g: Array, C: Array, c: Array, limit: float) -> tuple[Array, bool]:
    tau: Array = np.negative(np.linalg.solve(H, g))
    feasible = bool(np.all(np.abs(tau) <= limit) and np.all(np.isfinite(tau)))
    for row in range(C.shape[0]):
        if np.sum(C[row] * tau) < c[row] - _TOLERANCE:
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
    M_inverse: Array, nle: Array, J: Array, dJ: Array, v: Array, R: Array, p_foot: Array,
    contact: Array, trunk: Array, swing: Array, force: Array,
    gamma_tau: float, gamma_force: float, gamma_defect: float, mu: float, force_min: float,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:  # fmt: skip
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

    M_inverse = np.ascontiguousarray(M_inverse)
    M_inverse_S = np.ascontiguousarray(M_inverse[:, 6:])
    free = M_inverse @ nle
    if n_c > 0:
        M_inverse_Jt = M_inverse @ np.ascontiguousarray(J_c.T)
        Lambda_inverse = J_c @ M_inverse_Jt
        for k in range(3 * n_c):
            Lambda_inverse[k, k] *= 1.0 + 1e-9
        right = np.empty((3 * n_c, 13))
        right[:, :12] = -(J_c @ M_inverse_S)
        right[:, 12] = J_c @ free - drift_c
        affine = np.linalg.solve(Lambda_inverse, right)
        A = np.ascontiguousarray(affine[:, :12])
        a0 = np.ascontiguousarray(affine[:, 12])
        acceleration = M_inverse_S + M_inverse_Jt @ A
        acceleration0 = M_inverse_Jt @ a0 - free
    else:
        A, a0 = np.zeros((0, 12)), np.zeros(0)
        acceleration, acceleration0 = M_inverse_S.copy(), -free

    n_h = 6 + 12 - 3 * n_c
    B, b = np.empty((n_h, 12)), np.empty(n_h)
    Rc = np.ascontiguousarray(R)
    B[:3] = Rc @ acceleration[:3]
    b[:3] = Rc @ (acceleration0[:3] + cross(v[3:6], v[:3])) - trunk[:3]
    B[3:6] = Rc @ acceleration[3:6]
    b[3:6] = Rc @ acceleration0[3:6] - trunk[3:]
    B[6:] = J_s @ acceleration
    b[6:] = J_s @ acceleration0 + drift_s - a_swing

    At, Bt = np.ascontiguousarray(A.T), np.ascontiguousarray(B.T)
    H = gamma_force * (At @ A) + gamma_defect * (Bt @ B)
    for k in range(12):
        H[k, k] += gamma_tau
    g = gamma_force * (At @ (a0 - f_des)) + gamma_defect * (Bt @ b)
    scale = 12.0 / np.trace(H)

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
    return 0.5 * scale * (H + H.T), scale * g, C, c, A, a0, B, b


@compiled
def _closed_form(
    M_inverse: Array, nle: Array, J: Array, dJ: Array, v: Array, R: Array, p_foot: Array,
    contact: Array, trunk: Array, swing: Array, force: Array,
    gamma_tau: float, gamma_force: float, gamma_defect: float, mu: float, force_min: float,
) -> tuple[Array, int, bool]:  # fmt: skip
    """The optimum without limits, and whether it keeps them.

    Torques, forces and defect are one array (42,), whose last part is as long as is told.
    """
    H, g, C, c, A, a0, B, defect0 = _assemble(
        M_inverse, nle, J, dJ, v, R, p_foot, contact, trunk, swing, force,
        gamma_tau, gamma_force, gamma_defect, mu, force_min,
    )  # fmt: skip
    x = np.zeros(42)
    tau, feasible = _unconstrained(H, g, C, c, TORQUE_LIMIT)
    implied, defect = _implied(A, a0, B, defect0, contact, tau)
    x[:12] = tau
    x[12:24] = implied.ravel()
    x[24 : 24 + len(defect)] = defect
    return x, len(defect), feasible
