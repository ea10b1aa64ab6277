"""The team's planner: one QP over all robots' forces, of eq. 7 or of DeePC (eq. 5).

DeePC's g, σ and y are eliminated exactly, which leaves a QP in the future inputs alone.

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

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.gait import horizon_stance, nominal_forces, phase_of, place_in, walking_steps
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.qp import (
    NO_BOUNDS,
    Condensed,
    PlannerProblem,
    condense,
    constrain,
    stance_columns,
    unpack,
)
from quadriga.agents.planner.solver import NOMINAL, SOLVED, SOLVERS, DaqpSolver
from quadriga.agents.predictor.episode import Episode, team_layout
from quadriga.agents.predictor.predictor import Predictor, check_sizes
from quadriga.agents.predictor.regression import Reduction, reduce
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import N_LEGS, Array

Collected = Callable[[], Sequence[Episode]]
Formulation = Callable[[int, NDArray[np.bool_]], Condensed]  # of contact phase and stance


@dataclass(frozen=True, slots=True)
class TeamResult:
    """Plans of all robots of one planning step, always usable.

    Attributes:
        status: "solved", or "nominal:<reason>".
        u: forces, swing legs exactly zero, (n, N, 12), N.
        y: predicted outputs, (n, N, 6).
    """

    status: str
    u: Array
    y: Array


class TeamPlanner:
    """Immutable set-up of the team's planner; `step` depends on its arguments alone.

    `formulation` is of one of `phases` contact phases and the team's stance, (N n, 4).
    """

    def __init__(self, config: Config, formulation: Formulation, phases: int = 1) -> None:
        self._config, self._formulation, self._phases = config, formulation, phases
        self._cycle = walking_steps(config)
        self._setup = cache(self._build_setup)  # of a step of the gait's cycle
        for step in self._cycle:
            self._setup(step)

    def step(self, inputs: Sequence[PlannerInputs]) -> TeamResult:
        """Plan the horizon of one planning step for all robots, by their inputs in their order."""
        n, N = len(inputs), self._config.planner.N
        problem, solver, nominal = self._setup(place_in(self._cycle, inputs[0].step))
        past = np.concatenate([robot.past() for robot in inputs])
        base = np.concatenate([robot.y_base for robot in inputs])
        y_des = np.concatenate([robot.wanted() for robot in inputs])
        y_free = problem.condensed.free(past, y_des)
        solution = solver.solve(problem.linear_term(past, y_des), y_free - y_des)
        du, dy = unpack(problem, solution.x, y_free)
        return TeamResult(
            SOLVED if solution.status == SOLVED else with_detail(NOMINAL, solution.status),
            (nominal + du).reshape(n, N, -1),
            (base + dy).reshape(n, N, -1),
        )

    def _build_setup(self, step: int) -> tuple[PlannerProblem, DaqpSolver, Array]:
        """The problem of a step, its solver, and the nominal forces of its horizon."""
        config, weight, robots = self._config, self._config.robot.weight, self._config.team.robots
        stance = np.concatenate([horizon_stance(config, i, step) for i in range(robots)])
        condensed = self._formulation(phase_of(config, step, self._phases), stance)
        problem = constrain(config.planner, weight, condensed, stance)
        solver = SOLVERS[config.planner.solver](problem)
        return problem, solver, nominal_forces(stance, weight)


def build_centralised(
    config: Config, predictor: Predictor, _collected: Collected | None = None
) -> TeamPlanner:
    """The planner of eq. 7: the transition matrix of the whole team.

    Raises:
        PredictorError: the predictor's sizes are not the configuration's.
    """
    check_sizes(config, predictor)
    past = predictor.layout.past

    def formulation(phase: int, stance: NDArray[np.bool_]) -> Condensed:
        robots = range(config.team.robots)
        blocks = [[predictor.block(i, j, phase) for j in robots] for i in robots]
        G_past = np.block([[block[:, :past] for block in row] for row in blocks])
        G_u = np.block([[block[:, past:] for block in row] for row in blocks])
        return condense(config.planner, G_past, G_u, stance)

    return TeamPlanner(config, formulation, predictor.phases)


def build_deepc(config: Config, _predictor: Predictor | None, collected: Collected) -> TeamPlanner:
    """The planner of eq. 5 with g and σ eliminated, from the collected episodes.

    Raises:
        ConfigError: output bounds, which the elimination of g does not allow.
    """
    planner = config.planner
    if planner.output_bounds != NO_BOUNDS:
        got, expected = repr(planner.output_bounds), repr(NO_BOUNDS)
        cause = 'with planner.kind = "deepc" the outputs are eliminated together with g'
        raise ConfigError("planner.output_bounds", got, expected, cause)
    layout = team_layout(config.team.robots, planner.T_ini, planner.N)
    model = build_model(reduce(collected(), layout), planner)
    return TeamPlanner(config, lambda _, stance: select(model, stance_columns(stance)))


def build_model(reduction: Reduction, config: PlannerConfig) -> Condensed:
    """The problem of eq. 5 in all 12 n N forces of the team, with g, σ and y eliminated.

    Past and y are stacked robot by robot; rows and columns of each robot are ordered as in a
    `Predictor`. The predicted y is drawn towards y_des, because eq. 5 lets g choose among the
    trajectories that the data allow. `select` keeps the forces of stance legs.
    """
    layout, M, response = reduction.layout, reduction.spread, reduction.response
    n, T_ini, N = layout.agents, layout.T_ini, layout.N
    m_p, p_p, p_f = n * layout.inputs * T_ini, n * layout.outputs * T_ini, n * layout.rows
    # Places of all robots' u_ini and of their y_ini in past.
    places = np.arange(n * layout.past).reshape(n, -1)
    past_u, past_y = (part.ravel() for part in np.split(places, [layout.inputs * T_ini], axis=1))
    u_scale, y_scale = np.tile(layout.u_scale, n * (T_ini + N)), np.tile(layout.y_scale, n * N)
    Omega = [np.full(p_p, config.lambda_sigma), np.tile(config.Q, n * N) * y_scale**2]
    root = np.sqrt(np.concatenate(Omega))

    # z = C⁻ᵀ Z √Ω t and Λ = √Ω (I − Zᵀ Z) √Ω with C Cᵀ = λ_g I + Mᵀ Ω M and Z = C⁻¹ Mᵀ √Ω.
    weighted = root[:, None] * M
    C = linalg.cholesky(config.lambda_g * np.eye(M.shape[1]) + weighted.T @ weighted, lower=True)
    Z = linalg.solve_triangular(C, weighted.T, lower=True)
    chosen = linalg.solve_triangular(C, M[p_p:].T, lower=True).T @ Z * root  # [0 I] M z = chosen t
    Lambda = root[:, None] * (np.eye(len(root)) - Z.T @ Z) * root

    # Scaled t = T_past @ past + T_des @ y_des − B u, of physical past, y_des and u.
    T_past, T_des = np.zeros((p_p + p_f, m_p + p_p)), np.zeros((p_p + p_f, p_f))
    T_past[:, past_u] = -response[:, :m_p] / u_scale[:m_p]
    T_past[np.arange(p_p), past_y] = 1.0 / np.tile(layout.y_scale, n * T_ini)
    T_des[p_p:] = np.diag(1.0 / y_scale)
    B = response[:, m_p:] / u_scale[m_p:]

    effort = config.lambda_g / np.outer(u_scale[m_p:], u_scale) * reduction.inverse[m_p:]
    gradient = B.T @ Lambda
    H = gradient @ B + effort[:, m_p:]
    H.flat[:: len(H) + 1] += np.tile(config.R, N_LEGS * n * N)
    F_past, Y_past = -gradient @ T_past, chosen @ T_past
    F_past[:, past_u] += effort[:, :m_p]
    Y_past[:, past_u] += response[p_p:, :m_p] / u_scale[:m_p]
    return Condensed(
        H=0.5 * (H + H.T),
        F_past=F_past,
        F_des=-gradient @ T_des,
        Y_v=y_scale[:, None] * (B[p_p:] - chosen @ B),
        Y_past=y_scale[:, None] * Y_past,
        Y_des=y_scale[:, None] * (chosen @ T_des),
    )


def select(model: Condensed, columns: NDArray[np.int64]) -> Condensed:
    """The same problem with all forces but `columns` zero: exact for legs that swing."""
    H, Y_v = model.H[np.ix_(columns, columns)], np.ascontiguousarray(model.Y_v[:, columns])
    return replace(model, H=H, F_past=model.F_past[columns], F_des=model.F_des[columns], Y_v=Y_v)
