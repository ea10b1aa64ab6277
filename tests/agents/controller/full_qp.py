"""The whole-body QP as the paper states it, in (τ, f, δ), from Pinocchio's frames, by OSQP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import osqp
import pinocchio as pin
from scipy import sparse

from quadriga.shared.robots.conventions import Array
from tests.a1 import TORQUE_LIMIT
from tests.agents.estimator.poses import FEET, MODEL

_FRAME = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
_S = np.vstack([np.zeros((6, 12)), np.eye(12)])


@dataclass(frozen=True)
class Dynamics:
    """v̇ = M⁻¹ (S τ + J_cᵀ f − h), with r̈ = J_c v̇ + d_c = 0 and ḧ = J_h v̇ + d_h."""

    M_inverse: Array
    nle: Array
    J_c: Array
    d_c: Array
    J_h: Array
    d_h: Array


def dynamics(pose: Any) -> Dynamics:
    """Pinocchio's terms: contact feet, then the outputs (trunk, remaining feet)."""
    data = MODEL.createData()
    M = pin.crba(MODEL, data, pose.q)
    nle = pin.rnea(MODEL, data, pose.q, pose.v, np.zeros(18)).copy()
    pin.computeJointJacobians(MODEL, data, pose.q)
    pin.forwardKinematics(MODEL, data, pose.q, pose.v, np.zeros(18))
    pin.updateFramePlacements(MODEL, data)
    J = [pin.getFrameJacobian(MODEL, data, foot, _FRAME)[:3] for foot in FEET]
    d = [pin.getFrameClassicalAcceleration(MODEL, data, foot, _FRAME).linear for foot in FEET]
    on, off = np.flatnonzero(pose.contact > 0.5), np.flatnonzero(pose.contact < 0.5)
    R = pose.R
    trunk = np.zeros((6, 18))
    trunk[:3, :3] = trunk[3:, 3:6] = R
    centripetal = np.concatenate([R @ np.cross(pose.v[3:6], pose.v[:3]), np.zeros(3)])
    return Dynamics(
        np.linalg.inv(np.triu(M) + np.triu(M, 1).T),
        nle,
        np.vstack([np.zeros((0, 18)), *(J[leg] for leg in on)]),
        np.concatenate([np.zeros(0), *(d[leg] for leg in on)]),
        np.vstack([trunk, *(J[leg] for leg in off)]),
        np.concatenate([centripetal, *(d[leg] for leg in off)]),
    )


def desired(pose: Any) -> Array:
    """The outputs' desired accelerations in the order of `Dynamics.J_h`."""
    return np.concatenate([pose.acc_des, *pose.swing_acc_des[pose.contact < 0.5]])


def solve_full(pose: Any, weights: Any) -> tuple[Array, Array, Array]:
    """Optimal torques (12,), stacked contact forces (3 n_c,) and defect (6 + 3 n_s,).

    Raises:
        RuntimeError: OSQP does not call its answer solved.
    """
    dyn, n_c = dynamics(pose), int(pose.contact.sum())
    n_f, n_h = 3 * n_c, len(dyn.d_h)
    f_des = pose.force_des[pose.contact > 0.5].ravel()
    gammas = (weights.gamma_tau, weights.gamma_force, weights.gamma_defect)
    P = np.repeat(gammas, (12, n_f, n_h))
    W = np.repeat((1.0, weights.tilt_length, weights.swing_weight), (3, 3, n_h - 6))
    P[12 + n_f :] *= W**2
    q = np.concatenate([np.zeros(12), -weights.gamma_force * f_des, np.zeros(n_h)])
    drive = np.hstack([dyn.M_inverse @ _S, dyn.M_inverse @ dyn.J_c.T])
    free = dyn.M_inverse @ dyn.nle
    cone = np.array(
        [
            [0, 0, 1],
            *([sx, sy, weights.mu / np.sqrt(2)] for sx, sy in ((1, 0), (-1, 0), (0, 1), (0, -1))),
        ]
    )
    A = np.vstack(
        [
            np.hstack([dyn.J_c @ drive, np.zeros((n_f, n_h))]),
            np.hstack([dyn.J_h @ drive, -np.eye(n_h)]),
            np.eye(12, 12 + n_f + n_h),
            np.hstack(
                [np.zeros((5 * n_c, 12)), np.kron(np.eye(n_c), cone), np.zeros((5 * n_c, n_h))]
            ),
        ]
    )
    fixed = np.concatenate([dyn.J_c @ free - dyn.d_c, dyn.J_h @ free - dyn.d_h + desired(pose)])
    limit = np.full(12, TORQUE_LIMIT)
    least = np.tile([weights.force_min, 0.0, 0.0, 0.0, 0.0], n_c)
    lower = np.concatenate([fixed, -limit, least])
    upper = np.concatenate([fixed, limit, np.full(5 * n_c, np.inf)])
    return _split(_osqp(P, q, A, lower, upper), n_f)


def _split(x: Array, n_f: int) -> tuple[Array, Array, Array]:
    return x[:12], x[12 : 12 + n_f], x[12 + n_f :]


def _osqp(P: Array, q: Array, A: Array, lower: Array, upper: Array) -> Array:
    """Minimise ½ xᵀ diag(P) x + qᵀ x, lower ≤ A x ≤ upper; scaled to unit curvature and rows."""
    column = 1.0 / np.sqrt(P)
    row = 1.0 / np.linalg.norm(A * column, axis=1)
    solver = osqp.OSQP()
    solver.setup(
        sparse.identity(len(P), format="csc"),
        column * q,
        sparse.csc_matrix(row[:, None] * A * column),
        row * lower,
        row * upper,
        verbose=False,
        eps_abs=1e-10,
        eps_rel=1e-10,
        max_iter=200_000,
        polishing=True,
        adaptive_rho_interval=50,
    )
    result = solver.solve(raise_error=False)
    if result.info.status != "solved":
        raise RuntimeError(f"the reference: {result.info.status}")
    x: Array = column * result.x
    return x
