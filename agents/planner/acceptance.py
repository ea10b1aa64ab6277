"""Which predictors a team may plan with: those that pass all gates, with the planner's own QPs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from quadriga.agents.planner.cooperation import (
    OWN,
    cooperative_radius,
    cost_of,
    is_cooperative,
    kept_share,
    team_hessian,
)
from quadriga.agents.planner.qp import build_problem
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.gates import (
    GAIN_TIMES,
    GateReport,
    coupling_table,
    height_gains,
    held_out_error,
    peers_figures,
)
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import REMEDY, Provenance, read
from quadriga.agents.time_grid import distinct_steps, horizon_stance, phase_of
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorFileError
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import OUTPUTS, Array

_SAME: Final = 1e-6  # relative: other machines have other last digits, other costs differ by more
# Fields of the meta that must be as configured, beside the controller's keys.
_MATCHED: Final = (
    "robots",
    "robot",
    "stance_ms",
    "alternate_phase",
    "yokes",
    "interface",
    "N",
    "T_ini",
)


def load_checked(path: Path, config: Config) -> tuple[Predictor, Provenance]:
    """Read a predictor and refuse any that is not for this team or has not passed its gates.

    The figures are compared with the limits of `config`. If the agents respond to each other's
    plans, and their QPs are not those that the stored radius is of, it is computed again.

    Raises:
        PredictorFileError: no such file, not a predictor, corrupt, fitted for another team, gait,
            horizon, interface or low level.
        PredictorError: a figure is beyond its gate's limit.
    """
    predictor, provenance = read(path)
    check_fitted_for(config, path, predictor)
    gates = gates_in_force(provenance.gates, config, predictor)
    gates.check(config.planner.kind)
    return predictor, replace(provenance, gates=gates)


def check_fitted_for(config: Config, path: Path, predictor: Predictor) -> None:
    """Refuse a predictor of another team, gait, horizon, interface or low level.

    Args:
        config: the team's configuration.
        path: the predictor's file, for the error.
        predictor: what was read from it.

    Raises:
        PredictorFileError: it was fitted for another setting.
    """
    got, expected = predictor.meta, PredictorMeta.of(config)
    pairs = [(name, getattr(got, name), getattr(expected, name)) for name in _MATCHED]
    fitted = dict(got.controller)
    pairs += [(f"controller.{k}", fitted.get(k), wanted) for k, wanted in expected.controller]
    for name, stored, wanted in pairs:
        if stored != wanted:
            raise PredictorFileError(
                f"predictor {path}: {name}",
                repr(stored),
                f"{wanted!r} as configured",
                f"fitted for another setting; {REMEDY}",
            )


def run_gates(config: Config, predictor: Predictor, held_out: Sequence[Episode]) -> GateReport:
    """Measure the figures of a predictor; `GateReport.check` compares them with their limits.

    Args:
        config: team, gait, controller and limits.
        predictor: whose figures are measured.
        held_out: episodes that the fit has not seen.

    Raises:
        PredictorError: no held-out episode is long enough.
    """
    windows, rmse, persistence, error = held_out_error(predictor, held_out)
    return GateReport(
        windows=windows,
        rmse=dict(zip(OUTPUTS, rmse, strict=True)),
        rmse_persistence=dict(zip(OUTPUTS, persistence, strict=True)),
        error=error,
        gain_times=GAIN_TIMES,
        gains=tuple(tuple(row) for row in height_gains(config, predictor).tolist()),
        gain_limits=tuple(config.identification.gain_range),
        radius=iteration_radius(config, predictor),
        radius_limit=radius_limit(config),
        Q=tuple(config.planner.Q),
        R=tuple(config.planner.R),
        condition=predictor.condition,
        coupling=tuple(tuple(row) for row in coupling_table(predictor).tolist()),
        size=predictor.nbytes,
        cost_probes=probe_costs(config, predictor),
        cost=cost_of(config),
        peers=peers_figures(predictor, held_out, config.identification.max_peers_harm),
    )


def gates_in_force(gates: GateReport, config: Config, predictor: Predictor) -> GateReport:
    """The figures of a predictor with the limits of `config` and the radius of its QPs.

    Args:
        gates: as they are stored with the predictor.
        config: the team's configuration.
        predictor: whose figures these are.
    """
    limits, planner = config.identification, config.planner
    needs_peers = find_kind(planner.kind).needs_peers
    gates = replace(gates, gain_limits=tuple(limits.gain_range))
    if gates.peers is not None:
        gates = replace(gates, peers=replace(gates.peers, harm_limit=limits.max_peers_harm))
    if needs_peers or gates.cost == OWN:
        gates = replace(gates, radius_limit=radius_limit(config))
    if not needs_peers:
        return gates
    probes = probe_costs(config, predictor)
    if are_same_costs(probes, gates.cost_probes):
        return gates
    return replace(
        gates,
        radius=iteration_radius(config, predictor),
        cost=cost_of(config),
        Q=planner.Q,
        R=planner.R,
        cost_probes=probes,
    )


# ---- whether the iteration of the agents' plans converges


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
    steps = distinct_steps(config, predictor.phases)
    if is_cooperative(config):
        probes = [-1.0 - max(0.0, config.planner.damping)]
        for step in steps:
            H, _ = team_hessian(config, predictor, step)
            v = np.random.default_rng(0).uniform(0.5, 1.5, len(H))
            probes.append(float(v @ H @ v))
        return tuple(probes)
    kept = kept_share(config)
    probes = [-kept] if kept else []
    for step in steps:
        random = np.random.default_rng(0)
        hessian = gradient = 0.0
        for cost in _local_costs(config, predictor, step):
            p, q = (random.uniform(0.5, 1.5, size) for size in cost.gradient.shape)
            hessian += float(p @ cost.H @ p)
            gradient += float(p @ cost.gradient @ q)
        probes += [hessian, gradient]
    return tuple(probes)


def are_same_costs(probes: tuple[float, ...], others: tuple[float, ...]) -> bool:
    """Whether two results of `probe_costs` are of the same QPs."""
    return len(probes) == len(others) and np.allclose(probes, others, rtol=_SAME, atol=0.0)


def _local_costs(config: Config, predictor: Predictor, step: int) -> list[_LocalCost]:
    """The cost of each agent's QP at a planning step, as the planner builds it."""
    phase, costs = phase_of(config, step, predictor.phases), []
    for i in range(predictor.meta.robots):
        G_u = predictor.future_block(i, i, phase)
        stance = horizon_stance(config, i, step)
        problem = build_problem(config.planner, config.robot.weight, G_u, stance)
        costs.append(_LocalCost(problem.H, problem.gradient, problem.columns))
    return costs
