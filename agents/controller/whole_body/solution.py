"""Solving the whole-body QP: a closed form where no limit is active, else an active set (DAQP)."""

from __future__ import annotations

from typing import Final

import daqp
import numpy as np

from quadriga.agents.controller.maths.dense import cholesky, cholesky_solve, dot
from quadriga.agents.controller.maths.rigid_body import RigidBodyTerms
from quadriga.agents.controller.whole_body.assembly import build
from quadriga.agents.controller.whole_body.problem import (
    CONSTRAINED,
    INFEASIBLE,
    SOLUTION_SIZE,
    UNCONSTRAINED,
    Goal,
    Weights,
    WholeBodyProblem,
    WholeBodySolution,
)
from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.codes import with_detail

_TOLERANCE: Final = 1e-9
_UNBOUNDED: Final = 1e30  # DAQP's infinity
_OPTIMAL: Final = 1  # DAQP's flag


def solve_goal(
    terms: RigidBodyTerms, R: Array, p_foot: Array, goal: Goal, weights: Weights, bounds: Array
) -> WholeBodySolution:
    """Build, solve, unpack; numbers beyond all bounds or a singular problem are no solution."""
    problem = build(terms, R, p_foot, goal, weights, bounds)
    return unpack(problem, goal.contact, *solve(problem))


def solve(problem: WholeBodyProblem) -> tuple[Array, str]:
    """The optimal torques, (12,), N·m, and the status, see `WholeBodySolution`."""
    tau, feasible = _unconstrained(problem)
    if feasible:
        return tau, UNCONSTRAINED
    if not np.isfinite(tau).all():
        return np.zeros(N_JOINTS), with_detail(INFEASIBLE, "singular")
    rows = N_JOINTS + len(problem.c)
    upper = np.full(rows, _UNBOUNDED)
    lower = np.empty(rows)
    upper[:N_JOINTS] = problem.tau_max
    lower[:N_JOINTS] = problem.tau_min
    lower[N_JOINTS:] = problem.c
    tau, _, flag, _ = daqp.solve(
        problem.H, problem.g, problem.C, upper, lower, np.zeros(rows, dtype=np.intc)
    )
    if flag != _OPTIMAL or not np.isfinite(tau).all():
        return np.zeros(N_JOINTS), with_detail(INFEASIBLE, str(flag))
    return np.clip(tau, problem.tau_min, problem.tau_max), CONSTRAINED


def unpack(problem: WholeBodyProblem, contact: Array, tau: Array, status: str) -> WholeBodySolution:
    """Forces and defect that the torques imply."""
    x = np.zeros(SOLUTION_SIZE)
    _imply(problem, contact, tau, x)
    return WholeBodySolution(x, status, len(problem.defect0))


@compiled
def solve_closed_form(
    terms: RigidBodyTerms,
    R: Array,
    p_foot: Array,
    goal: Goal,
    weights: Weights,
    bounds: Array,
    x: Array,
) -> int:
    """Fill `x`, see `WholeBodySolution`, with the optimum without limits.

    Args:
        terms: of the rigid body.
        R: trunk to odometry frame, (3, 3).
        p_foot: foot centres, (4, 3), m, odometry frame.
        goal: what is asked for.
        weights: of the QP.
        bounds: τ_min and τ_max of each motor, (2, 12), N·m.
        x: (42,), zero.

    Returns:
        The length of the defect; 0 if the optimum breaks a limit.
    """
    problem = build(terms, R, p_foot, goal, weights, bounds)
    tau, feasible = _unconstrained(problem)
    _imply(problem, goal.contact, tau, x)
    return len(problem.defect0) if feasible else 0


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


@compiled
def _imply(problem: WholeBodyProblem, contact: Array, tau: Array, x: Array) -> None:
    """Fill torques, forces and defect, see `WholeBodySolution`."""
    A, a0, defect0 = problem.A, problem.a0, problem.defect0
    x[:12] = tau
    row = 0
    for leg in range(4):
        if contact[leg] > 0.5:
            for axis in range(3):
                x[12 + 3 * leg + axis] = dot(A[row + axis], tau) + a0[row + axis]
            row += 3
    for k in range(len(defect0)):
        x[24 + k] = dot(problem.B[k], tau) + defect0[k]
