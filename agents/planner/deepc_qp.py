"""DeePC (eq. 5) with g, σ and y eliminated exactly: a QP in the future inputs alone.

    min Σ ‖y − y_des‖²_Q + ‖u‖²_R + λ_g ‖g‖² + λ_σ ‖σ‖²
    s.t. [U_p; Y_p; U_f; Y_f] g + [0; σ; 0; 0] = [u_ini; y_ini; u; y],   u in its set

Of the data's `Reduction`, b + [σ; 0] = Φ a + M z with a = [u_ini; u] and b = [y_ini; y], z is
unconstrained. So it is a linear map of t = [y_ini; y_des] − Φ a, and with Ω = diag(λ_σ, Q) what
remains is

    tᵀ Λ t + λ_g aᵀ S_aa⁻¹ a + ‖u‖²_R,   Λ = Ω − Ω M (λ_g I + Mᵀ Ω M)⁻¹ Mᵀ Ω

This holds for data without noise too; their M has only as many columns as the plant has states.
With a small λ_g, z alone meets any y_des and the inputs have no effect. A large λ_g draws the
inputs, through aᵀ S_aa⁻¹ a, towards those that followed such a past in the data. Both are
properties of eq. 5 itself. g, σ and S belong to scaled signals, all else is in physical units; of a
team of robots these are deviations in N, m, m/s, rad, rad/s. Bounds on y would constrain z: with
them this is no longer the paper's problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.planner.planner_qp import Condensed
from quadriga.agents.predictor.episode import Layout
from quadriga.agents.predictor.regression import Reduction
from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import N_LEGS, Array

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class DeepcWeights:
    """Weights of eq. 5, those of signals for one sample of one agent.

    Attributes:
        Q: of the outputs, physical, shape (p,).
        R: of the inputs, physical, shape (m,).
        lambda_g: λ_g.
        lambda_sigma: λ_σ, of scaled outputs, shape (p,).
    """

    Q: Array
    R: Array
    lambda_g: float
    lambda_sigma: Array


def build_model(
    reduction: Reduction, config: PlannerConfig, lambda_g: float, lambda_sigma: float
) -> Condensed:
    """Eliminate g, σ and y of a team's problem; see `eliminate`.

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
    Q, R = np.array(config.Q), np.tile(config.R, N_LEGS)
    return eliminate(reduction, DeepcWeights(Q, R, lambda_g, np.full(len(Q), lambda_sigma)))


def eliminate(reduction: Reduction, weights: DeepcWeights) -> Condensed:
    """Eliminate g, σ and y for one choice of weights.

    Past and y are stacked agent by agent; rows and columns of each agent are ordered as in a
    `Predictor`. The predicted y is drawn towards y_des, because eq. 5 lets g choose among the
    trajectories that the data allow.

    Args:
        reduction: of the data.
        weights: all of them positive.

    Returns:
        The problem in all m n N future inputs.
    """
    layout, M = reduction.layout, reduction.spread
    n, T_ini, N = layout.agents, layout.T_ini, layout.N
    m_p, p_p = n * layout.inputs * T_ini, n * layout.outputs * T_ini
    y_scale = np.tile(layout.y_scale, n * N)
    root = np.sqrt(
        np.concatenate(
            [np.tile(weights.lambda_sigma, n * T_ini), np.tile(weights.Q, n * N) * y_scale**2]
        )
    )

    # z = C⁻ᵀ Z √Ω t and Λ = √Ω (I − Zᵀ Z) √Ω with C Cᵀ = λ_g I + Mᵀ Ω M and Z = C⁻¹ Mᵀ √Ω.
    weighted = root[:, None] * M
    C = linalg.cholesky(weights.lambda_g * np.eye(M.shape[1]) + weighted.T @ weighted, lower=True)
    Z = linalg.solve_triangular(C, weighted.T, lower=True)
    chosen = linalg.solve_triangular(C, M[p_p:].T, lower=True).T @ Z * root  # [0 I] M z = chosen t
    Lambda = root[:, None] * (np.eye(len(root)) - Z.T @ Z) * root

    T_past, T_des, B = _residual(reduction)
    u_all = np.tile(layout.u_scale, n * (T_ini + N))
    effort = weights.lambda_g / np.outer(u_all[m_p:], u_all) * reduction.inverse[m_p:]
    gradient = B.T @ Lambda
    H = gradient @ B + effort[:, m_p:]
    H.flat[:: len(H) + 1] += np.tile(weights.R, n * N)
    past_u, _ = _past_columns(layout)
    F_past, Y_past = -gradient @ T_past, chosen @ T_past
    F_past[:, past_u] += effort[:, :m_p]
    Y_past[:, past_u] += reduction.response[p_p:, :m_p] / u_all[:m_p]
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
    layout, response = reduction.layout, reduction.response
    n, T_ini, N = layout.agents, layout.T_ini, layout.N
    m_p, p_p, p_f = n * layout.inputs * T_ini, n * layout.outputs * T_ini, n * layout.rows
    past_u, past_y = _past_columns(layout)
    T_past, T_des = np.zeros((p_p + p_f, m_p + p_p)), np.zeros((p_p + p_f, p_f))
    T_past[:, past_u] = -response[:, :m_p] / np.tile(layout.u_scale, n * T_ini)
    T_past[np.arange(p_p), past_y] = 1.0 / np.tile(layout.y_scale, n * T_ini)
    T_des[p_p:] = np.diag(1.0 / np.tile(layout.y_scale, n * N))
    return T_past, T_des, response[:, m_p:] / np.tile(layout.u_scale, n * N)


def _past_columns(layout: Layout) -> tuple[Index, Index]:
    """Places of all agents' u_ini and of their y_ini in past."""
    index = np.arange(layout.agents * layout.past).reshape(layout.agents, -1)
    inputs = layout.inputs * layout.T_ini
    return index[:, :inputs].ravel(), index[:, inputs:].ravel()
