"""The best-response map of the agents' plans; its spectral radius tells whether they converge."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from quadriga.agents.planner.planner_qp import build_problem
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.time_grid import horizon_stance, phase_of, walking_steps
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array


def best_response_map(config: Config, predictor: Predictor, step: int) -> Array:
    """The linear map from all agents' present plans to their next, without inequality constraints.

    U_i ← −H_ii⁻¹ G_iiᵀ Q̄ Σ_{j≠i} G_ij U_j over the stance legs of planning step `step`, with
    the G of its phase.
    Shape (s, s), s being the number of stance forces of the team (150 per robot at N = 25).
    """
    n, phase = predictor.meta.robots, phase_of(config, step, predictor.phases)
    problems = [
        build_problem(
            config.planner,
            config.robot.weight,
            predictor.future_block(i, i, phase),
            horizon_stance(config, i, step),
        )
        for i in range(n)
    ]
    rows = []
    for i, problem in enumerate(problems):
        coupling = [
            np.zeros_like(problem.H)
            if i == j
            else problem.gradient @ predictor.future_block(i, j, phase)[:, problems[j].columns]
            for j in range(n)
        ]
        factor = linalg.cho_factor(problem.H)
        rows.append(-linalg.cho_solve(factor, np.concatenate(coupling, axis=1)))
    return np.concatenate(rows)


def best_response_radius(config: Config, predictor: Predictor) -> float:
    """Spectral radius of the best-response map, the largest over stance patterns and phases.

    Below 1 the one-step-delay iteration of the agents' plans converges; 0 for a single robot.
    """
    n = predictor.meta.robots
    if n == 1:
        return 0.0
    distinct: dict[tuple[int, bytes], int] = {}
    for step in walking_steps(config):
        patterns = b"".join(horizon_stance(config, i, step).tobytes() for i in range(n))
        distinct.setdefault((phase_of(config, step, predictor.phases), patterns), step)
    return max(
        float(np.abs(linalg.eigvals(best_response_map(config, predictor, step))).max())
        for step in distinct.values()
    )
