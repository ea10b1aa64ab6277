"""Plans that answer each other, and how their iteration converges.

With the cost "team" each agent minimises the cost of the whole team over its own forces. With
z_l = [u_ini; y_ini; u] of robot l and e the commanded less the base outputs, which the team's
robots have in common, that is

    V(u_1 … u_n) = Σ_j ½‖Σ_l G_jl z_l − e‖²_Q̄ + ½‖u_j‖²_R̄.

Agent i minimises it over u_i alone, with its peers' plans fixed, and stays near its own last plan
u_i, brought forward to now:

    u_i⁺ = argmin over the feasible u of V(…, u, …) + ½ (1/w − 1) ‖u − u_i‖²_Dᵢ,

D_i = H_ii being the Hessian of V by u_i. Where no bound is active that is the convex combination
w û_i + (1 − w) u_i of the best new plan û_i and the last one.

Why that converges, whatever the coupling. Let d = u⁺ − u, D the block diagonal of the Hessian H of
V. Each u_i⁺ is optimal in a convex set that holds u_i, so ∇V · d ≤ −dᵀ D d / w, and

    V(u + d) − V(u) ≤ −dᵀ D d / w + ½ dᵀ H d ≤ −(1/w − ½ λ_max) dᵀ D d

with λ_max the largest eigenvalue of D⁻¹H: V falls, bounds or not, for any w < 2/λ_max; λ_max ≤ n,
so that w = 1/n always will do (Stewart, Venkat, Rawlings, Wright and Pannocchia, Cooperative
distributed model predictive control, Systems & Control Letters 59, 2010). V is strictly convex and
each agent's bounds are its own, so the limit is the optimum of eq. 7.

Peers do not know yet what an agent has measured since its last plan, so nobody else reacts to it.
Before u_i counts as the last plan it is therefore moved by the agent's best reaction to that
innovation, the difference δ between its window and the one that its last plan predicted:
−D_i⁻¹ Σ_j G_jiᵀ Q̄ G_ji,past δ. In an iteration on the same windows there is none.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from scipy import linalg

from quadriga.agents.gait import distinct_steps, horizon_stance, phase_of
from quadriga.agents.planner.qp import (
    NO_BOUNDS,
    Condensed,
    PlannerProblem,
    constrain,
    stance_columns,
)
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import N_OUTPUTS, Array

TEAM: Final = "team"  # of planner.cost
_BY_SIZE: Final = -1.0  # value of planner.damping


def is_cooperative(config: Config) -> bool:
    """Whether each agent of a team plans for all of it, knowing its peers' plans."""
    answers = config.team.robots > 1 and find_kind(config.planner.kind).needs_peers
    return answers and config.planner.cost == TEAM


def brings_forward(config: Config) -> bool:
    """Whether peers' windows and plans are brought forward by their age.

    Who plans for the team needs its peers' outputs from now on, so it does without being asked.
    """
    return config.planner.compensation or is_cooperative(config)


def coupled_peers(config: Config, index: int, predictor: Predictor) -> frozenset[int]:
    """Robots whose plans matter to agent `index`: the members that explain its outputs.

    With the team's cost also those that explain an output which its own forces move.
    """
    if not find_kind(config.planner.kind).needs_peers:
        return frozenset()
    members = predictor.layout.members
    moved = [each for each in members if index in each]
    matter = moved if is_cooperative(config) else [members[index]]
    return frozenset().union(*matter) - {index}


def team_slope(config: Config, predictor: Predictor, index: int, step: int) -> Array:
    """[G_1i; …; G_ni]ᵀ Q̄ of the stance forces of agent i at a step: the slope of V by team outputs.

    Returns:
        Shape (n, nv, 6 N), by robot whose outputs they are.
    """
    phase, stance = phase_of(config, step, predictor.phases), horizon_stance(config, index, step)
    columns, Q = stance_columns(stance), np.tile(config.planner.Q, config.planner.N)
    blocks = [predictor.future_block(j, index, phase) for j in range(config.team.robots)]
    return np.stack([block[:, columns].T * Q for block in blocks])


def build_team_problem(
    config: Config, predictor: Predictor, index: int, step: int
) -> PlannerProblem:
    """The QP of agent i over its own stance forces v, with the team's cost and its own constraints.

        H = Σ_j G_jiᵀ Q̄ G_ji + R̄,   f = Σ_j G_jiᵀ Q̄ (G_ji,past past_i − e) + Σ_l≠i M_il z_l

    The last sum comes from the peers (`peer_slope`). The predicted outputs are the agent's own.
    """
    phase, stance = phase_of(config, step, predictor.phases), horizon_stance(config, index, step)
    past, columns = predictor.layout.past, stance_columns(stance)
    slopes = team_slope(config, predictor, index, step)
    F_past = np.zeros((len(columns), past))
    H = np.diag(np.tile(config.planner.R, len(columns) // 3))
    for j, slope in enumerate(slopes):
        block = predictor.block(j, index, phase)
        F_past += slope @ block[:, :past]
        H += slope @ block[:, past + columns]
    own = predictor.block(index, index, phase)
    Y_v, Y_past = (np.ascontiguousarray(own[:, part]) for part in (past + columns, slice(past)))
    condensed = Condensed(0.5 * (H + H.T), F_past, -slopes.sum(axis=0), Y_v, Y_past)
    return constrain(config.planner, config.robot.weight, condensed, stance)


def peer_slope(slopes: Array, predictor: Predictor, peer: int, phase: int) -> Array:
    """M_il = Σ_j G_jiᵀ Q̄ G_jl of one peer l: what its z_l adds to f. (nv, 18 T_ini + 12 N).

    `slopes` are the `team_slope` of agent i.
    """
    M = np.zeros((slopes.shape[1], predictor.layout.width))
    for j, slope in enumerate(slopes):
        M += slope @ predictor.block(j, peer, phase)
    return M


def team_hessian(config: Config, predictor: Predictor, step: int) -> tuple[Array, Array]:
    """H, the Hessian of V by all agents' stance forces, and D, its block diagonal. (s, s) each."""
    robots, phase = range(config.team.robots), phase_of(config, step, predictor.phases)
    columns = [stance_columns(horizon_stance(config, i, step)) for i in robots]
    G = np.block([[predictor.future_block(i, j, phase)[:, columns[j]] for j in robots]
                  for i in robots])  # fmt: skip
    H = (G.T * np.tile(config.planner.Q, len(G) // N_OUTPUTS)) @ G
    H.flat[:: len(H) + 1] += np.tile(config.planner.R, len(H) // 3)
    H = 0.5 * (H + H.T)
    owner = np.repeat(robots, [len(places) for places in columns])
    return H, np.where(owner[:, None] == owner, H, 0.0)


def stay_near_last(
    problem: PlannerProblem, f: Array, w: float, last: Array, innovation: Array
) -> Array:
    """The linear term of w times the QP that stays near the last plan; its Hessian is that of V.

    `problem` is of `build_team_problem`, f the linear term of V by own stance forces, (nv,), w the
    new plan's share, `last` the last plan of these forces, (nv,), N, `innovation` δ, (18 T_ini,).
    """
    condensed = problem.condensed
    return w * f + (1.0 - w) * (condensed.F_past @ innovation - condensed.H @ last)


def new_plan_share(config: Config, predictor: Predictor) -> float:
    """w, the share of û_i in an agent's plan: 1 less `planner.damping`, unless that is 0 or -1.

    Then it is the one with which the iteration of the plans contracts fastest where no bound is
    active, and at most 1: its eigenvalues are 1 − w λ, the largest of them in size least at
    w = 2/(λ_min + λ_max). That is below 2/λ_max, so V falls with bounds, too. Of all planning
    steps the least w.
    """
    if config.planner.damping > 0.0:
        return 1.0 - config.planner.damping
    return min(1.0, *(2.0 / sum(ends) for ends in _eigenvalue_ranges(config, predictor)))


def cooperative_radius(config: Config, predictor: Predictor) -> float:
    """Spectral radius of the iteration u ← u − w D⁻¹(H u + f), the largest of all planning steps.

    Below 1 exactly where w < 2/λ_max, which is enough for convergence with bounds as well.
    """
    w, ranges = new_plan_share(config, predictor), _eigenvalue_ranges(config, predictor)
    return max(abs(1.0 - w * end) for ends in ranges for end in ends)


@lru_cache(maxsize=2)  # the agents in one process ask for the same
def _eigenvalue_ranges(config: Config, predictor: Predictor) -> tuple[tuple[float, float], ...]:
    """Least and largest eigenvalue of D⁻¹H at each distinct planning step; 1 lies between."""
    steps = distinct_steps(config, predictor.phases)
    each = (linalg.eigh(*team_hessian(config, predictor, k), eigvals_only=True) for k in steps)
    return tuple((float(values[0]), float(values[-1])) for values in each)


# ---- damping of best responses, with the own cost


def kept_share(config: Config) -> float:
    """d, the share of its own last plan that a best response keeps; chosen, 0 if it answers nobody.

    By the size of the team: where n robots act on each other alike, with effects c of their own,
    the undamped map has the eigenvalues c and −c (n − 1). Keeping d, the largest in size is least
    at d = c (n − 2) / (2 + c (n − 2)), with c = 1/2 at (n − 2) / (n + 2). The gate on the radius
    tells whether that is enough. Few robots converge without it.
    """
    planner, n = config.planner, config.team.robots
    if planner.output_bounds != NO_BOUNDS:  # a last plan may break them by now
        return 0.0
    if planner.damping != _BY_SIZE:
        return planner.damping
    few = 3 if planner.preset == "usual" else 2
    answers = find_kind(planner.kind).needs_peers
    return (n - 2) / (n + 2) if answers and n > few else 0.0
