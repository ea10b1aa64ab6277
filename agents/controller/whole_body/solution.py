"""Solving the whole-body QP: a closed form where no limit is active, else an active set (DAQP)."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.controller.maths.dense import cholesky, cholesky_solve, dot
from quadriga.agents.controller.maths.rigid_body import RigidBodyTerms
from quadriga.agents.controller.whole_body.assembly import build
from quadriga.agents.controller.whole_body.limited import (
    LIMITED,
    LIMITED_SIZE,
    fill_limited,
    imply,
    solve_limited,
)
from quadriga.agents.controller.whole_body.problem import (
    UNCONSTRAINED,
    Goal,
    Weights,
    WholeBodyProblem,
    WholeBodySolution,
)
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_TOLERANCE: Final = 1e-9


def solve_goal(
    terms: RigidBodyTerms, R: Array, p_foot: Array, goal: Goal, weights: Weights, bounds: Array
) -> WholeBodySolution:
    """Build, solve, unpack; numbers beyond all bounds or a singular problem are no solution."""
    row = np.empty(LIMITED_SIZE)
    free = solve_closed_form(terms, R, p_foot, goal, weights, bounds, row)
    return finish(free, row, goal.contact)


def finish(free: bool, row: Array, contact: Array) -> WholeBodySolution:
    """The solution after `solve_closed_form`.

    Args:
        free: what it returned.
        row: what it filled; x changes where a limit is active.
        contact: 1 for the feet that push, (4,).
    """
    status = UNCONSTRAINED if free else solve_limited(row, contact)
    return WholeBodySolution(row[LIMITED.x], status, contact)


@compiled
def solve_closed_form(
    terms: RigidBodyTerms,
    R: Array,
    p_foot: Array,
    goal: Goal,
    weights: Weights,
    bounds: Array,
    row: Array,
) -> bool:
    """Find the optimum without limits; where it breaks one, keep the problem for `solve_limited`.

    Args:
        terms: of the rigid body.
        R: trunk to odometry frame, (3, 3).
        p_foot: foot centres, (4, 3), m, odometry frame.
        goal: what is asked for.
        weights: of the QP.
        bounds: τ_min and τ_max of each motor, (2, 12), N·m.
        row: (LIMITED_SIZE,); x is filled, the rest if the optimum breaks a limit.

    Returns:
        Whether the optimum keeps the limits.
    """
    problem = build(terms, R, p_foot, goal, weights, bounds)
    tau, feasible = _unconstrained(problem)
    imply(problem.A, problem.a0, problem.B, problem.defect0, goal.contact, tau, row[LIMITED.x])
    if not feasible:
        fill_limited(problem, row)
    return feasible


@compiled
def _unconstrained(problem: WholeBodyProblem) -> tuple[Array, bool]:
    """The minimiser without limits, and whether it keeps them; NaN of a singular problem."""
    step = np.negative(problem.g).reshape(12, 1)
    cholesky_solve(cholesky(problem.H), step)
    tau = step[:, 0].copy()
    C, c = problem.C, problem.c
    feasible = True
    for k in range(12):
        if not problem.tau_min[k] <= tau[k] <= problem.tau_max[k]:
            feasible = False
    for row in range(len(c)):
        if not dot(C[row], tau) >= c[row] - _TOLERANCE:
            feasible = False
    return tau, feasible
