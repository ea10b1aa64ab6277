"""Solvers of the local QP by name; each answer carries its status and its own residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final, Protocol

import daqp
import numpy as np
import osqp
from scipy import linalg, sparse

from quadriga.agents.planner.foot_limits import (
    FAILED,
    ForceQp,
    has_foot_limits,
    minimise_freely,
    minimise_within,
)
from quadriga.agents.planner.optimality import MAX_STATIONARITY, Residuals, is_optimal, residuals
from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.shared.robots.conventions import Array

SOLVED: Final = "solved"
NOMINAL: Final = "nominal"  # code of a plan's status: no solution, hence the nominal forces
_FAR: Final = 1e30  # DAQP's infinity
_DAQP_STATUS: Final = MappingProxyType({
    1: SOLVED, -1: "infeasible", -2: "cycling", -3: "unbounded", -4: "iteration-limit",
    -5: "not-convex", -6: "overdetermined",
})  # fmt: skip
_SLACK: Final = 1e-9  # relative to the bounds: what is not told from rounding
_FLAT: Final = 1e-4  # ‖Aᵀ y‖ over ‖y‖ of a certificate: OSQP's own tolerance
_OSQP_INFEASIBLE: Final = (
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE,
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE,
)


@dataclass(frozen=True, slots=True)
class QpSolution:
    """A solver's answer; `x` is zero, that is no deviation, unless the status is "solved"."""

    status: str
    x: Array
    multipliers: Array
    residuals: Residuals
    iterations: int


@dataclass(frozen=True, slots=True)
class SolvedQp:
    """A QP of one step, min ½ xᵀ H x + fᵀ x, lower ≤ [x; A x] ≤ upper, with its answer.

    Attributes:
        problem: whose H and A these are.
        f: linear term, shape (nx,).
        lower, upper: bounds, shape (nx + m,).
        solution: the solver's answer.
    """

    problem: PlannerProblem
    f: Array
    lower: Array
    upper: Array
    solution: QpSolution


@dataclass(frozen=True, slots=True)
class CompiledQp:
    """A QP that limits forces alone, for compiled functions.

    Attributes:
        qp: what does not depend on f.
        residuals: of −H⁻¹ f, which is the optimum while no bound is active: bounds for any f.
    """

    qp: ForceQp
    residuals: Residuals


class Solver(Protocol):
    """Solves one `PlannerProblem` for any f and bounds; no answer depends on earlier solves."""

    def __init__(self, problem: PlannerProblem) -> None: ...

    @property
    def compiled(self) -> CompiledQp | None:
        """The QP for compiled code, which gives the answers of `solve`; None where it cannot."""
        ...

    def solve(self, f: Array, lower: Array | None = None, upper: Array | None = None) -> QpSolution:
        """The minimiser, or the reason why there is none. Never raises for a bad f.

        Args:
            f: linear term, shape (nx,).
            lower: bounds of [x; A x] from below, shape (nx + m,); None: those of the problem.
            upper: bounds from above.
        """
        ...


class DaqpSolver:
    """The closed form while no bound is active, then `minimise_within`, else DAQP.

    All are exact, and no solve knows of the ones before it, so that equal data give equal bits.
    DAQP, a dense dual active set, solves what bounds outputs and what the second leaves.
    """

    def __init__(self, problem: PlannerProblem) -> None:
        self._problem = problem
        inverse = linalg.inv(problem.H)
        bounds = np.ascontiguousarray(problem.lower), np.ascontiguousarray(problem.upper)
        qp = ForceQp(np.ascontiguousarray(problem.H), -inverse, *bounds, problem.slope)
        exact = Residuals(_inversion_error(problem.H, inverse), 0, 0)
        limits_feet = not len(problem.bounded) and has_foot_limits(*bounds, problem.slope)
        usable = limits_feet and exact.stationarity <= MAX_STATIONARITY
        self._compiled = CompiledQp(qp, exact) if usable else None
        self._free = np.zeros(len(problem.upper))
        self._free.setflags(write=False)
        self._cold = np.zeros(len(problem.upper), dtype=np.int32)
        self._model = daqp.Model()
        self._model.settings = {"primal_tol": 1e-8}
        self._ready, _ = self._model.setup(
            problem.H,
            np.zeros(len(problem.H)),
            problem.A,
            np.minimum(problem.upper, _FAR),
            np.maximum(problem.lower, -_FAR),
            self._cold,
        )
        # DAQP's first solve loads its code, which must not fall into a walk.
        self.solve(np.zeros(len(problem.H)), problem.lower, problem.upper)

    @property
    def compiled(self) -> CompiledQp | None:
        """See `Solver`."""
        return self._compiled

    def solve(self, f: Array, lower: Array | None = None, upper: Array | None = None) -> QpSolution:
        """See `Solver`."""
        if self._ready < 0:  # contradictory bounds are detected at set-up
            return no_solution(self._problem, _DAQP_STATUS.get(self._ready, "failed"))
        if not math.isfinite(f @ f):
            return no_solution(self._problem, "not-finite")
        if self._compiled is not None and lower is None and upper is None:
            x, inside = minimise_freely(self._compiled.qp, f)
            if inside:
                return QpSolution(SOLVED, x, self._free, self._compiled.residuals, 0)
            found = minimise_within(self._compiled.qp, f, x)
            if found.solutions != FAILED and is_optimal(found.primal, found.stationarity):
                proof = Residuals(found.stationarity, found.primal, found.complementarity)
                return QpSolution(SOLVED, found.v, found.multipliers, proof, found.solutions)
        low = self._problem.lower if lower is None else lower
        high = self._problem.upper if upper is None else upper
        if upper is None:
            self._model.update(f=f, sense=self._cold)
        else:
            self._model.update(
                f=f, sense=self._cold, bupper=np.minimum(high, _FAR), blower=np.maximum(low, -_FAR)
            )
        x, _, flag, info = self._model.solve()
        status = _DAQP_STATUS.get(flag, "failed")
        return judge(self._problem, f, x, info["lam"], status, int(info["iterations"]), low, high)


class OsqpSolver:
    """Operator splitting, as in the paper; set up anew for each f so that nothing is carried."""

    def __init__(self, problem: PlannerProblem) -> None:
        self._problem = problem
        self._P = sparse.csc_matrix(np.triu(problem.H))
        self._A = sparse.csc_matrix(np.vstack([np.eye(len(problem.H)), problem.A]))

    @property
    def compiled(self) -> CompiledQp | None:
        """See `Solver`; None, so that OSQP gives every answer, as in the paper."""
        return None

    def solve(self, f: Array, lower: Array | None = None, upper: Array | None = None) -> QpSolution:
        if not np.isfinite(f).all():
            return no_solution(self._problem, "not-finite")
        low = self._problem.lower if lower is None else lower
        high = self._problem.upper if upper is None else upper
        if (low > high).any():
            return no_solution(self._problem, "infeasible")
        result = self._run(f, low, high)
        if result.info.status_val in _OSQP_INFEASIBLE and not self._proves(result, low, high):
            # A row of zeros that must be at most -1e-17, or two rows that exclude each other by
            # as much, are a proof to OSQP. Judged is by the bounds as they are.
            slack = _SLACK * (1.0 + np.maximum(np.abs(low), np.abs(high)))
            slack[np.isinf(slack)] = _SLACK
            result = self._run(f, low - slack, high + slack)
        info = result.info
        status = info.status.replace(" ", "-")
        if info.status_val in _OSQP_INFEASIBLE:
            status = "infeasible" if self._proves(result, low, high) else "inaccurate"
        y = np.where(np.isinf(high), np.minimum(result.y, 0.0), result.y)
        y = np.where(np.isinf(low), np.maximum(y, 0.0), y)
        return judge(self._problem, f, result.x, y, status, int(info.iter), low, high)

    def _proves(self, result: Any, low: Array, high: Array) -> bool:
        """Whether a certificate y shows that low ≤ A x ≤ high has no solution.

        It does if Aᵀ y = 0 and highᵀ y⁺ + lowᵀ y⁻ < 0, by more than bounds are rounded.
        """
        y = result.prim_inf_cert
        up, down = np.maximum(y, 0.0), np.minimum(y, 0.0)
        if up[np.isinf(high)].any() or down[np.isinf(low)].any():
            return False
        bounded = np.where(up > 0.0, high, np.where(down < 0.0, low, 0.0))
        flat = np.abs(self._A.T @ y).max() <= _FLAT * np.abs(y).max()
        return bool(flat and bounded @ y < -_SLACK * ((1.0 + np.abs(bounded)) @ np.abs(y)))

    def _run(self, f: Array, low: Array, high: Array) -> Any:
        """What OSQP answers."""
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
        return solver.solve(raise_error=False)


def _inversion_error(H: Array, inverse: Array) -> float:
    """Bound of ‖H x + f‖∞ / ‖f‖∞ for x = −H⁻¹ f and every f, rounding of the product included."""
    left = np.abs(np.eye(len(H)) - H @ inverse) + len(H) * np.finfo(float).eps * (
        np.abs(H) @ np.abs(inverse)
    )
    return float(left.sum(axis=1).max())


SOLVERS: Final[Mapping[str, type[Solver]]] = MappingProxyType(
    {"daqp": DaqpSolver, "osqp": OsqpSolver}
)


def no_solution(problem: PlannerProblem, status: str) -> QpSolution:
    """The typed answer "no solution" with its reason."""
    worst = Residuals(np.inf, np.inf, np.inf)
    return QpSolution(status, np.zeros(len(problem.H)), np.zeros(len(problem.upper)), worst, 0)


def judge(
    problem: PlannerProblem,
    f: Array,
    v: Array,
    multipliers: Array,
    status: str,
    iterations: int,
    lower: Array | None = None,
    upper: Array | None = None,
) -> QpSolution:
    """Check an answer against the optimality conditions; one that fails is "inaccurate"."""
    if status != SOLVED:
        return no_solution(problem, status)
    checked = residuals(problem, f, v, multipliers, lower, upper)
    if not is_optimal(checked.primal, checked.stationarity):
        return replace(no_solution(problem, "inaccurate"), residuals=checked)
    return QpSolution(SOLVED, v, multipliers, checked, iterations)
