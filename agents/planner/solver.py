"""Solvers of the planner's QP by name; each answer carries its status and its own residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import daqp
import numpy as np
import osqp
from scipy import linalg, sparse

from quadriga.agents.planner.foot_limits import FAILED, ForceQp, minimise
from quadriga.agents.planner.qp import (
    MAX_STATIONARITY,
    PlannerProblem,
    Residuals,
    is_optimal,
    residuals,
)
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.record import record

SOLVED: Final = "solved"
NOMINAL: Final = "nominal"  # code of a plan's status: no solution, hence the nominal forces
_FAR: Final = 1e30  # DAQP's infinity
_DAQP_STATUS: Final = {
    1: SOLVED, -1: "infeasible", -2: "cycling", -3: "unbounded", -4: "iteration-limit",
    -5: "not-convex", -6: "overdetermined",
}  # fmt: skip


@record
class QpSolution:
    """A solver's answer; `x` is zero, that is no deviation, unless the status is "solved"."""

    status: str
    x: Array
    multipliers: Array
    residuals: Residuals
    iterations: int


@record
class SolvedQp:
    """A QP of one step, min ½ xᵀ H x + fᵀ x, lower ≤ [x; A x] ≤ upper, with its answer.

    Attributes:
        problem: whose H, A and bounds these are.
        f: linear term, shape (nx,).
        solution: the solver's answer.
    """

    problem: PlannerProblem
    f: Array
    solution: QpSolution


class DaqpSolver:
    """Solves one `PlannerProblem` for any f: by `foot_limits.minimise`, else by DAQP.

    Both are exact, and no solve knows of the ones before it, so that equal data give equal bits.
    DAQP, a dense dual active set, solves what bounds outputs and what the first leaves.

    Attributes:
        force_qp: the QP without bounds of outputs, for compiled code.
        limits_feet: whether compiled code may answer: that is all there is to the QP.
    """

    def __init__(self, problem: PlannerProblem) -> None:
        self._problem = problem
        H, inverse = np.ascontiguousarray(problem.H), linalg.inv(problem.H)
        bounds = np.ascontiguousarray(problem.lower), np.ascontiguousarray(problem.upper)
        exact = _inversion_error(H, inverse)
        self.force_qp = ForceQp(H, -inverse, *bounds, problem.slope, exact)
        feasible = bool((problem.lower <= problem.upper).all())
        self.limits_feet = feasible and exact <= MAX_STATIONARITY and not len(problem.bounded)
        self._cold = np.zeros(len(problem.upper), dtype=np.int32)
        self._model = daqp.Model()
        self._model.settings = {"primal_tol": 1e-8}
        zero, reach = np.zeros(len(H)), _within_reach(problem)
        self._ready, _ = self._model.setup(problem.H, zero, problem.A, *reach, self._cold)
        # The first solve loads the code, which must not fall into a walk.
        DaqpSolver.solve(self, zero)
        self._solve_by_daqp(zero, problem)

    def solve(self, f: Array, error: Array | None = None) -> QpSolution:
        """The minimiser for f, (nx,), or the reason why there is none. Never raises for a bad f.

        Bounds of outputs depend on `error`, see `PlannerProblem.shifted`.
        """
        if self.limits_feet:
            found = minimise(self.force_qp, f)
            if found.solutions != FAILED:
                return QpSolution(SOLVED, *found)
        return self._solve_by_daqp(f, self._problem.shifted(error))

    def _solve_by_daqp(self, f: Array, problem: PlannerProblem) -> QpSolution:
        if self._ready < 0:  # contradictory bounds are detected at set-up
            return no_solution(problem, _DAQP_STATUS.get(self._ready, "failed"))
        if not math.isfinite(f @ f):
            return no_solution(problem, "not-finite")
        upper, lower = _within_reach(problem)
        self._model.update(f=f, sense=self._cold, bupper=upper, blower=lower)
        x, _, flag, info = self._model.solve()
        status = _DAQP_STATUS.get(flag, "failed")
        return judge(problem, f, x, info["lam"], status, int(info["iterations"]))


class OsqpSolver(DaqpSolver):
    """Operator splitting, as in the paper; set up anew for each f so that nothing is carried.

    What it does not solve is left to DAQP: bounds that contradict each other by rounding alone are
    a proof of infeasibility to OSQP.
    """

    def __init__(self, problem: PlannerProblem) -> None:
        super().__init__(problem)
        self.limits_feet = False
        self._P = sparse.csc_matrix(np.triu(problem.H))
        self._A = sparse.csc_matrix(np.vstack([np.eye(len(problem.H)), problem.A]))

    def solve(self, f: Array, error: Array | None = None) -> QpSolution:
        """See `DaqpSolver`."""
        problem = self._problem.shifted(error)
        low, high = problem.lower, problem.upper
        if not np.isfinite(f).all() or (low > high).any():
            return self._solve_by_daqp(f, problem)
        solver = osqp.OSQP()
        solver.setup(
            self._P,
            f,
            self._A,
            low,
            high,
            verbose=False,
            eps_abs=1e-8,
            eps_rel=1e-9,
            eps_dual_inf=1e-15,  # H is positive definite: no cost falls without end
            max_iter=20000,
            adaptive_rho=1,
            adaptive_rho_interval=50,  # by iterations, never by time
        )
        result = solver.solve(raise_error=False)
        y = np.where(np.isinf(high), np.minimum(result.y, 0.0), result.y)
        y = np.where(np.isinf(low), np.maximum(y, 0.0), y)
        status, iterations = result.info.status, int(result.info.iter)
        answer = judge(problem, f, result.x, y, status, iterations)
        return answer if answer.status == SOLVED else self._solve_by_daqp(f, problem)


SOLVERS: Final[Mapping[str, type[DaqpSolver]]] = {"daqp": DaqpSolver, "osqp": OsqpSolver}


def no_solution(problem: PlannerProblem, status: str) -> QpSolution:
    """The typed answer "no solution" with its reason."""
    worst = Residuals(np.inf, np.inf, np.inf)
    return QpSolution(status, np.zeros(len(problem.H)), np.zeros(len(problem.upper)), worst, 0)


def judge(
    problem: PlannerProblem, f: Array, v: Array, multipliers: Array, status: str, iterations: int
) -> QpSolution:
    """Check an answer against the optimality conditions; one that fails is "inaccurate"."""
    if status != SOLVED:
        return no_solution(problem, status)
    checked = residuals(problem, f, v, multipliers)
    if not is_optimal(checked):
        return replace(no_solution(problem, "inaccurate"), residuals=checked)
    return QpSolution(SOLVED, v, multipliers, checked, iterations)


def _within_reach(problem: PlannerProblem) -> tuple[Array, Array]:
    """Upper and lower bounds in DAQP's order and with its infinity."""
    return np.minimum(problem.upper, _FAR), np.maximum(problem.lower, -_FAR)


def _inversion_error(H: Array, inverse: Array) -> float:
    """Bound of ‖H x + f‖∞ / ‖f‖∞ for x = −H⁻¹ f and every f, rounding of the product included."""
    left = np.abs(np.eye(len(H)) - H @ inverse) + len(H) * np.finfo(float).eps * (
        np.abs(H) @ np.abs(inverse)
    )
    return float(left.sum(axis=1).max())
