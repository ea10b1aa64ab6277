"""The whole-body QP (the paper's low-level controller): assembly, solution, forces and defect.

min  γ₁/2 |τ|² + γ₂/2 |f − f_des|² + γ₃/2 |W δ|²
s.t. ḧ(τ, f) = a_des + δ   (output dynamics: trunk and swing feet; a_des holds −K_P h − K_D ḣ)
     r̈(τ, f) = 0           (no slip of the feet in contact)
     τ_min ≤ τ ≤ τ_max,  f in the friction cone

W = diag(1, 1, 1, ℓ, ℓ, ℓ, s, s, …) says what a rad/s² of the trunk and a m/s² of a swing foot weigh
against a m/s² of the trunk (the paper: ℓ = 1 m, s = 1).

No slip makes the forces affine in the torques, f = A τ + a₀, and with them the outputs,
ḧ = B τ + b₀: twelve variables, a box and five rows per foot in contact remain. A closed form
answers where no limit is active, else an active set (DAQP).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import daqp
import numpy as np

from quadriga.agents.controller.rigid_body import (
    RigidBodyTerms,
    add_gram,
    cholesky,
    cholesky_solve,
    dot,
    product,
    symmetrise,
    times,
    transposed_times,
)
from quadriga.agents.estimator.kinematics import cross
from quadriga.agents.estimator.robot_state import RecordRow, cuts_of_record
from quadriga.shared.codes import with_detail
from quadriga.shared.robots.conventions import N_FORCES, N_JOINTS, N_LEGS, Array
from quadriga.shared.robots.torque_speed import MotorCurves, torque_range
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record

UNCONSTRAINED: Final = "unconstrained"
CONSTRAINED: Final = "constrained"
INFEASIBLE: Final = "infeasible"

_TOLERANCE: Final = 1e-9
_UNBOUNDED: Final = 1e30  # DAQP's infinity
_OPTIMAL: Final = 1  # DAQP's flag
_CONE: Final = 5  # rows of a foot's friction cone
_OUTPUTS: Final = 18  # of a robot of which no foot is in contact
_LEAST_TORQUE: Final = 0.25  # of a motor's peak: without any torque the QP has no solution

# The QP min ½ τᵀ H τ + gᵀ τ  s.t. lower ≤ (τ, C τ) ≤ upper, and its answer, as a row of numbers
# between compiled code and solver. Of C, A, a0, B and defect0 the first rows are filled, as many as
# the n_c feet in contact ask for.
QP: Final = np.dtype(
    (
        np.record,
        [
            ("contact", float, N_LEGS),  # 1 for the feet that push
            ("H", float, (N_JOINTS, N_JOINTS)),
            ("g", float, N_JOINTS),
            ("C", float, (_CONE * N_LEGS, N_JOINTS)),  # 5 n_c rows
            ("lower", float, N_JOINTS + _CONE * N_LEGS),  # τ_min, then c of C τ ≥ c; N·m, N
            ("upper", float, N_JOINTS + _CONE * N_LEGS),  # τ_max, then nothing that bounds
            ("A", float, (N_FORCES, N_JOINTS)),  # forces of each torque, 3 n_c rows
            ("a0", float, N_FORCES),  # forces of none, N
            ("B", float, (_OUTPUTS, N_JOINTS)),  # outputs' accelerations, 18 − 3 n_c rows
            ("defect0", float, _OUTPUTS),  # defect of no torque, b₀ − a_des, m/s², rad/s²
            ("tau", float, N_JOINTS),  # N·m
            ("force", float, (N_LEGS, 3)),  # N, odometry frame
            ("defect", float, _OUTPUTS),  # δ, 18 − 3 n_c
        ],
    )
)


@record
class WholeBodySolution(RecordRow):
    """What came of the QP and how; its attributes are the fields of `QP`.

    Attributes:
        status: "unconstrained" (closed form), "constrained" (active set) or, with no torques and
            the rest of no use, "infeasible:<solver's flag>" or "infeasible:singular".
    """

    CUTS = cuts_of_record(QP)
    status: str

    @property
    def feet(self) -> int:
        """How many feet are in contact, n_c."""
        return int(np.count_nonzero(self.contact > 0.5))

    @property
    def solved(self) -> bool:
        """Whether the torques may be used."""
        return self.status in (UNCONSTRAINED, CONSTRAINED)


def solve_qp(row: Array, free: bool) -> WholeBodySolution:
    """The solution of what `build_qp` filled: numbers beyond bounds or a singular QP are none.

    Args:
        row: of `QP`; torques, forces and defect change where a limit is active.
        free: whether none is, see there.
    """
    solution = WholeBodySolution(row, UNCONSTRAINED)
    if free:
        return solution
    tau, status = np.zeros(N_JOINTS), with_detail(INFEASIBLE, "singular")
    if np.isfinite(solution.tau).all():
        rows = _CONE * solution.feet
        lower, upper = solution.lower[: N_JOINTS + rows], solution.upper[: N_JOINTS + rows]
        H, g, C = solution.H, solution.g, solution.C[:rows]
        x, _, flag, _ = daqp.solve(H, g, C, upper, lower, np.zeros(len(lower), dtype=np.intc))
        status = with_detail(INFEASIBLE, str(flag))
        if flag == _OPTIMAL and np.isfinite(x).all():
            tau, status = np.clip(x, lower[:N_JOINTS], upper[:N_JOINTS]), CONSTRAINED
    recover_forces(row, tau)
    return WholeBodySolution(row, status)


@compiled
def recover_forces(row: Array, tau: Array) -> None:
    """Fill torques (12,), N·m, and the forces and defect that follow; what is not there is zero."""
    qp, first = row.view(QP)[0], 0
    qp.tau[:], qp.force[:], qp.defect[:] = tau, 0.0, 0.0
    for leg in range(4):
        if qp.contact[leg] > 0.5:
            for axis in range(3):
                qp.force[leg, axis] = dot(qp.A[first + axis], tau) + qp.a0[first + axis]
            first += 3
    for k in range(_OUTPUTS - first):
        qp.defect[k] = dot(qp.B[k], tau) + qp.defect0[k]


@compiled
def torque_bounds(rates: Array, curves: MotorCurves) -> Array:
    """Least and greatest torque of each motor, (2, 12), N·m: what it has at its present rate.

    Args:
        rates: joint rates, (12,), rad/s.
        curves: of the motors.
    """
    bounds = np.empty((2, 12))
    for k in range(12):
        least = _LEAST_TORQUE * curves.peak[k]
        lower, upper = torque_range(rates[k], curves, k)
        bounds[0, k], bounds[1, k] = min(lower, -least), max(upper, least)
    return bounds


@compiled
def build_qp(
    terms: RigidBodyTerms, state: np.record, gains: np.record, bounds: Array, row: Array
) -> bool:
    """Assemble the reduced QP and find its optimum without limits.

    Args:
        terms: of the rigid body.
        state: `ROBOT_STATE`; asked for are `acc_des`, `swing_acc_des` and `force_des`.
        gains: `GAINS`.
        bounds: τ_min and τ_max of each motor, (2, 12), N·m.
        row: of `QP`, filled; NaN where no slip cannot be had.

    Returns:
        Whether the optimum keeps all limits.
    """
    qp = row.view(QP)[0]
    qp.contact[:] = state.contact
    on, off = _split_feet(terms, state)
    affine, acceleration = _resolve_contacts(terms, on)
    outputs = _output_dynamics(terms.v, state.R, acceleration, off, state.acc_des)
    forces, rows = len(affine), len(outputs)
    qp.A[:forces], qp.a0[:forces] = affine[:, :12], affine[:, 12]
    qp.B[:rows], qp.defect0[:rows] = outputs[:, :12], outputs[:, 12]
    qp.lower[:12], qp.upper[:12], qp.upper[12:] = bounds[0], bounds[1], _UNBOUNDED
    _fill_cost(qp, outputs, on.desired, gains)
    _fill_friction_cone(qp, forces // 3, gains.mu - state.mu_reduction, gains.force_min)
    step = np.negative(qp.g).reshape(12, 1)
    cholesky_solve(cholesky(qp.H), step)
    tau = step[:, 0].copy()
    recover_forces(row, tau)
    for k in range(12):
        if not qp.lower[k] <= tau[k] <= qp.upper[k]:
            return False
    for k in range(_CONE * forces // 3):
        if not dot(qp.C[k], tau) >= qp.lower[12 + k] - _TOLERANCE:
            return False
    return True


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
def _split_feet(terms: RigidBodyTerms, state: np.record) -> tuple[StackedFeet, StackedFeet]:
    """The feet in contact and the others."""
    n_on = 0
    for leg in range(4):
        if state.contact[leg] > 0.5:
            n_on += 3
    n_off = 12 - n_on
    on = StackedFeet(np.zeros((n_on, 18)), np.zeros(n_on), np.zeros(n_on))
    off = StackedFeet(np.zeros((n_off, 18)), np.zeros(n_off), np.zeros(n_off))
    i_on, i_off = 0, 0
    for leg in range(4):
        if state.contact[leg] > 0.5:
            rows = slice(i_on, i_on + 3)
            _fill_jacobian(terms, state.p_foot[leg], leg, on.J[rows], on.drift[rows])
            on.desired[rows] = state.force_des[leg]
            i_on += 3
        else:
            rows = slice(i_off, i_off + 3)
            _fill_jacobian(terms, state.p_foot[leg], leg, off.J[rows], off.drift[rows])
            off.desired[rows] = state.swing_acc_des[leg]
            i_off += 3
    return on, off


@compiled
def _fill_jacobian(
    terms: RigidBodyTerms, p: Array, leg: int, jacobian: Array, drift: Array
) -> None:
    """Fill the Jacobian (3, 18) and drift J̇v (3,) of one foot's centre at p, odometry frame."""
    J, dJ, v = terms.J, terms.dJ, terms.v
    bias, twist = np.zeros(6), np.zeros(6)
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
    v: Array, R: Array, acceleration: Array, feet: StackedFeet, acc_des: Array
) -> Array:
    """The outputs' accelerations of each torque, and of none less the desired ones.

    Args:
        v: generalised velocity, (18,).
        R: trunk to odometry frame, (3, 3).
        acceleration: v̇ of each torque and of none, (18, 13).
        feet: those not in contact.
        acc_des: desired acceleration of the trunk, (6,).

    Returns:
        (B, b₀ − a_des), (18 − 3 n_c, 13).
    """
    outputs = np.empty((6 + len(feet.J), 13))
    outputs[:3] = product(R, acceleration[:3])
    outputs[3:6] = product(R, acceleration[3:6])
    outputs[6:] = product(feet.J, acceleration)
    outputs[:3, 12] += times(R, cross(v[3:6], v[:3])) - acc_des[:3]
    outputs[3:6, 12] -= acc_des[3:]
    outputs[6:, 12] += feet.drift - feet.desired
    return outputs


@compiled
def _fill_cost(qp: np.record, outputs: Array, f_des: Array, gains: np.record) -> None:
    """Fill H and g, scaled so that the mean of H's diagonal is one.

    `outputs` are those of `_output_dynamics`; W is applied to them in place.
    """
    A, a0 = qp.A[: len(f_des)], qp.a0[: len(f_des)]
    H = np.zeros((12, 12))
    add_gram(gains.gamma_force, A, H)
    outputs[3:6] *= gains.tilt_length
    outputs[6:] *= gains.swing_weight
    W_B, W_b = outputs[:, :12].copy(), outputs[:, 12].copy()
    add_gram(gains.gamma_defect, W_B, H)
    trace = 0.0
    for k in range(12):
        H[k, k] += gains.gamma_tau
        trace += H[k, k]
    symmetrise(H)
    g = gains.gamma_force * transposed_times(A, a0 - f_des)
    g = g + gains.gamma_defect * transposed_times(W_B, W_b)
    scale = 12.0 / trace
    qp.H[:], qp.g[:] = scale * H, scale * g


@compiled
def _fill_friction_cone(qp: np.record, feet: int, mu: float, force_min: float) -> None:
    """Fill C τ ≥ c: the least normal force, and a pyramid inside the friction cone."""
    cone, A, a0, C, c = mu / np.sqrt(2.0), qp.A, qp.a0, qp.C, qp.lower[12:]
    for i in range(feet):
        row = _CONE * i
        x0, y0, z0 = a0[3 * i], a0[3 * i + 1], a0[3 * i + 2]
        c[row] = force_min - z0
        c[row + 1], c[row + 2] = x0 - cone * z0, -x0 - cone * z0
        c[row + 3], c[row + 4] = y0 - cone * z0, -y0 - cone * z0
        for k in range(12):  # no arithmetic of rows, which would allocate each of them
            x, y, z = A[3 * i, k], A[3 * i + 1, k], A[3 * i + 2, k]
            C[row, k] = z
            C[row + 1, k], C[row + 2, k] = cone * z - x, cone * z + x
            C[row + 3, k], C[row + 4, k] = cone * z - y, cone * z + y
