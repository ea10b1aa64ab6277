"""DeePC of the whole team (eq. 5) with g, σ and y eliminated exactly: a QP in the forces alone.

    min Σ ‖y − y_des‖²_Q + ‖u‖²_R + λ_g ‖g‖² + λ_σ ‖σ‖²
    s.t. [U_p; Y_p; U_f; Y_f] g + [0; σ; 0; 0] = [u_ini; y_ini; u; y],   u in its set

Of the data's `Reduction`, b + [σ; 0] = Φ a + M z with a = [u_ini; u] and b = [y_ini; y], z is
unconstrained. So it is a linear map of t = [y_ini; y_des] − Φ a, and with Ω = diag(λ_σ, Q) what
remains is

    tᵀ Λ t + λ_g aᵀ S_aa⁻¹ a + ‖u‖²_R,   Λ = Ω − Ω M (λ_g I + Mᵀ Ω M)⁻¹ Mᵀ Ω

This holds for data without noise too; their M has only as many columns as the plant has states.
With a small λ_g, z alone meets any y_des and the forces have no effect. A large λ_g draws the
forces, through aᵀ S_aa⁻¹ a, towards those that followed such a past in the data. Both are
properties of eq. 5 itself. g, σ and S belong to scaled deviations, all else is in N, m, m/s, rad,
rad/s. Bounds on y would constrain z: with them this is no longer the paper's problem.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.planner.planner_qp import Condensed
from quadriga.agents.predictor.deepc import Reduction
from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE
from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array

Index = NDArray[np.int64]


def build_model(
    reduction: Reduction, config: PlannerConfig, lambda_g: float, lambda_sigma: float
) -> Condensed:
    """Eliminate g, σ and y for one choice of weights.

    Past and y are stacked robot by robot; rows and columns of each robot are ordered as in a
    `Predictor`. The predicted y is drawn towards y_des, because eq. 5 lets g choose among the
    trajectories that the data allow.

    Args:
        reduction: of the team's data.
        config: Q and R.
        lambda_g: λ_g of eq. 5.
        lambda_sigma: λ_σ of eq. 5.

    Returns:
        The problem in all 12 n N forces of the team; `select` keeps those that may be non-zero.

    Raises:
        ConfigError: a weight that is not positive.
    """
    for name, weight in (("lambda_g", lambda_g), ("lambda_sigma", lambda_sigma)):
        if not weight > 0.0:
            raise ConfigError(name, f"{weight:g}", "a positive weight")
    n, T_ini, N, M = reduction.robots, reduction.T_ini, reduction.N, reduction.spread
    m_p, p_p = n * N_FORCES * T_ini, n * N_OUTPUTS * T_ini
    y_scale = np.tile(Y_SCALE, n * N)
    root = np.sqrt(
        np.concatenate([np.full(p_p, lambda_sigma), np.tile(config.Q, n * N) * y_scale**2])
    )

    # z = C⁻ᵀ Z √Ω t and Λ = √Ω (I − Zᵀ Z) √Ω with C Cᵀ = λ_g I + Mᵀ Ω M and Z = C⁻¹ Mᵀ √Ω.
    weighted = root[:, None] * M
    C = linalg.cholesky(lambda_g * np.eye(M.shape[1]) + weighted.T @ weighted, lower=True)
    Z = linalg.solve_triangular(C, weighted.T, lower=True)
    chosen = linalg.solve_triangular(C, M[p_p:].T, lower=True).T @ Z * root  # [0 I] M z = chosen t
    Lambda = root[:, None] * (np.eye(len(root)) - Z.T @ Z) * root

    T_past, T_des, B = _residual(reduction)
    effort = lambda_g / U_SCALE**2 * reduction.inverse[m_p:]
    gradient = B.T @ Lambda
    H = gradient @ B + effort[:, m_p:]
    H.flat[:: len(H) + 1] += np.tile(config.R, len(H) // 3)
    past_u, _ = _past_columns(n, T_ini)
    F_past, Y_past = -gradient @ T_past, chosen @ T_past
    F_past[:, past_u] += effort[:, :m_p]
    Y_past[:, past_u] += reduction.response[p_p:, :m_p] / U_SCALE
    return Condensed(
        H=0.5 * (H + H.T),
        F_past=F_past,
        F_des=-gradient @ T_des,
        Y_v=y_scale[:, None] * (B[p_p:] - chosen @ B),
        Y_past=y_scale[:, None] * Y_past,
        Y_des=y_scale[:, None] * (chosen @ T_des),
    )


def select(model: Condensed, columns: Index) -> Condensed:
    """The same problem with all forces but `columns` zero: exact for legs that swing."""
    return Condensed(
        H=model.H[np.ix_(columns, columns)],
        F_past=model.F_past[columns],
        F_des=model.F_des[columns],
        Y_v=np.ascontiguousarray(model.Y_v[:, columns]),
        Y_past=model.Y_past,
        Y_des=model.Y_des,
    )


def _residual(reduction: Reduction) -> tuple[Array, Array, Array]:
    """T = T_past @ past + T_des @ y_des − B u: scaled t, physical past, y_des and u."""
    n, T_ini, N = reduction.robots, reduction.T_ini, reduction.N
    m_p, p_p, p_f = n * N_FORCES * T_ini, n * N_OUTPUTS * T_ini, n * N_OUTPUTS * N
    past_u, past_y = _past_columns(n, T_ini)
    T_past, T_des = np.zeros((p_p + p_f, m_p + p_p)), np.zeros((p_p + p_f, p_f))
    T_past[:, past_u] = -reduction.response[:, :m_p] / U_SCALE
    T_past[np.arange(p_p), past_y] = 1.0 / np.tile(Y_SCALE, n * T_ini)
    T_des[p_p:] = np.diag(1.0 / np.tile(Y_SCALE, n * N))
    return T_past, T_des, reduction.response[:, m_p:] / U_SCALE


def _past_columns(n: int, T_ini: int) -> tuple[Index, Index]:
    """Places of all robots' u_ini and of their y_ini in past."""
    index = np.arange(n * (N_FORCES + N_OUTPUTS) * T_ini).reshape(n, -1)
    return index[:, : N_FORCES * T_ini].ravel(), index[:, N_FORCES * T_ini :].ravel()
