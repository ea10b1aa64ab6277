"""Whether the iteration of the agents' plans converges: its spectral radius, for either cost."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.planner.cooperation import cooperative_radius, is_cooperative, team_hessian
from quadriga.agents.planner.damping import kept_share
from quadriga.agents.planner.planner_qp import build_problem
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.time_grid import distinct_steps, horizon_stance, phase_of
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.robot.conventions import Array

_SAME: Final = 1e-6  # relative: other machines have other last digits, other costs differ by more
# What a problem's size and predictor depend on, and no cost.
_SIZES: Final = ("N", "T_ini", "applied", "interface")


class _LocalCost(NamedTuple):
    """Of one agent's QP: Hessian (nv, nv), G_iiᵀ Q̄ (nv, 6 N) and the places of its forces (nv,)."""

    H: Array
    gradient: Array
    columns: NDArray[np.int64]


def best_response_map(config: Config, predictor: Predictor, step: int) -> Array:
    """The linear map from all agents' present plans to their next, without inequality constraints.

    U_i ← −(1 − d) H_ii⁻¹ G_iiᵀ Q̄ Σ_{j≠i} G_ij U_j + d U_i over the stance legs of planning step
    `step`, with the G of its phase and the damping d. H_ii is that of the QP that is solved.
    Shape (s, s), s being the number of stance forces of the team (150 per robot at N = 25).
    """
    n, phase = predictor.meta.robots, phase_of(config, step, predictor.phases)
    costs, kept = _local_costs(config, predictor, step), kept_share(config)
    rows = []
    for i, cost in enumerate(costs):
        coupling = [
            np.zeros_like(cost.H)
            if i == j
            else cost.gradient @ predictor.future_block(i, j, phase)[:, costs[j].columns]
            for j in range(n)
        ]
        factor = linalg.cho_factor(cost.H)
        rows.append(-linalg.cho_solve(factor, np.concatenate(coupling, axis=1)))
    best: Array = np.concatenate(rows)
    return best if kept == 0.0 else (1.0 - kept) * best + kept * np.eye(len(best))


def best_response_radius(config: Config, predictor: Predictor) -> float:
    """Spectral radius of the best-response map, the largest over stance patterns and phases.

    Below 1 the one-step-delay iteration of the agents' plans converges; 0 for a single robot.
    """
    if predictor.meta.robots == 1:
        return 0.0
    return max(
        float(np.abs(linalg.eigvals(best_response_map(config, predictor, step))).max())
        for step in distinct_steps(config, predictor.phases)
    )


def iteration_radius(config: Config, predictor: Predictor) -> float:
    """Spectral radius of the iteration of the agents' plans with the configured cost."""
    if is_cooperative(config):
        return cooperative_radius(config, predictor)
    return best_response_radius(config, predictor)


def radius_limit(config: Config) -> float:
    """What the radius must be below.

    Cooperative plans converge wherever it is below 1, bounds or not. Of best responses none knows
    where bounds are active, hence the margin `identification.max_radius`.
    """
    return 1.0 if is_cooperative(config) else config.identification.max_radius


def probe_costs(config: Config, predictor: Predictor) -> tuple[float, ...]:
    """Numbers that tell the QPs that a radius belongs to: Σ pᵀ H p and Σ pᵀ G_uᵀ Q̄ q of each step.

    p and q are fixed, so that any key that changes a cost changes them, whatever it is called.
    Two numbers for each distinct planning step; () for a single robot. Of cooperative agents they
    are pᵀ H p of the team, after a number below −1 that tells them apart and has the damping. Of
    damped best responses the first number is −damping.
    """
    if predictor.meta.robots == 1:
        return ()
    if is_cooperative(config):
        return _probe_team(config, predictor)
    kept = kept_share(config)
    probes = [-kept] if kept else []
    for step in distinct_steps(config, predictor.phases):
        random = np.random.default_rng(0)
        hessian = gradient = 0.0
        for cost in _local_costs(config, predictor, step):
            p, q = (random.uniform(0.5, 1.5, size) for size in cost.gradient.shape)
            hessian += float(p @ cost.H @ p)
            gradient += float(p @ cost.gradient @ q)
        probes += [hessian, gradient]
    return tuple(probes)


def _probe_team(config: Config, predictor: Predictor) -> tuple[float, ...]:
    probes = [-1.0 - max(0.0, config.planner.damping)]
    for step in distinct_steps(config, predictor.phases):
        H, _ = team_hessian(config, predictor, step)
        p = np.random.default_rng(0).uniform(0.5, 1.5, len(H))
        probes.append(float(p @ H @ p))
    return tuple(probes)


def are_same_costs(probes: tuple[float, ...], others: tuple[float, ...]) -> bool:
    """Whether two results of `probe_costs` are of the same QPs."""
    return len(probes) == len(others) and np.allclose(probes, others, rtol=_SAME, atol=0.0)


def with_usual_costs(config: Config, Q: tuple[float, ...], R: tuple[float, ...]) -> Config:
    """The configuration with a cost of these weights and nothing else in it.

    Args:
        config: gives all that is no cost.
        Q: weights of the outputs.
        R: weights of the forces.
    """
    sizes = {name: getattr(config.planner, name) for name in _SIZES}
    return replace(config, planner=replace(PlannerConfig(), **sizes, Q=Q, R=R, damping=0.0))


def _local_costs(config: Config, predictor: Predictor, step: int) -> list[_LocalCost]:
    """The cost of each agent's QP at a planning step, as the planner builds it."""
    phase, costs = phase_of(config, step, predictor.phases), []
    for i in range(predictor.meta.robots):
        G_u = predictor.future_block(i, i, phase)
        stance = horizon_stance(config, i, step)
        problem = build_problem(config.planner, config.robot.weight, G_u, stance)
        costs.append(_LocalCost(problem.H, problem.gradient, problem.columns))
    return costs
