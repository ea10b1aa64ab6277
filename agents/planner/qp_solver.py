"""Solvers of the local QP by name; each answer carries its status and its own residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final, Protocol

import daqp
import numpy as np
import osqp
from scipy import linalg, sparse

from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.jit import compiled

SOLVED: Final = "solved"
NOMINAL: Final = "nominal"  # code of a plan's status: no solution, hence the nominal forces
_FAR: Final = 1e30  # DAQP's infinity
_DAQP_STATUS: Final = MappingProxyType({
    1: SOLVED, -1: "infeasible", -2: "cycling", -3: "unbounded", -4: "iteration-limit",
    -5: "not-convex", -6: "overdetermined",
})  # fmt: skip
_OSQP_INFEASIBLE: Final = (
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE,
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE,
)
# An answer with larger residuals is not used, whatever status the solver reports.
_MAX_VIOLATION: Final = 1e-5  # N
_MAX_STATIONARITY: Final = 1e-5  # relative to the terms of the gradient


@dataclass(frozen=True, slots=True)
class Residuals:
    """How well the Karush-Kuhn-Tucker conditions hold.

    Attributes:
        stationarity: ‖H v + f + λ_box + Aᵀ λ_A‖∞ over the largest of its terms (at least 1); for
            the closed form an upper bound of it.
        primal: largest violation of a bound [N].
        complementarity: largest |λ · distance to its bound|, over the same terms [N].
    """

    stationarity: float
    primal: float
    complementarity: float


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
class ClosedForm:
    """The optimum while no bound is active: x = −H⁻¹ f.

    Attributes:
        minus_inverse: −H⁻¹, (nv, nv).
        residuals: bounds of its residuals for any f.
    """

    minus_inverse: Array
    residuals: Residuals


class Solver(Protocol):
    """Solves one `PlannerProblem` for any f and bounds; no answer depends on earlier solves."""

    def __init__(self, problem: PlannerProblem) -> None: ...

    @property
    def closed_form(self) -> ClosedForm | None:
        """The closed form, equal to `solve` wherever its x keeps to the bounds, if there is one."""
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
    """The closed form while no bound is active, else a dense dual active set: exact.

    Every solve starts from the empty active set, so that equal data give equal bits.
    """

    def __init__(self, problem: PlannerProblem) -> None:
        self._problem = problem
        inverse = linalg.inv(problem.H)
        self._closed = ClosedForm(-inverse, Residuals(_inversion_error(problem.H, inverse), 0, 0))
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

    @property
    def closed_form(self) -> ClosedForm | None:
        exact = self._closed.residuals.stationarity <= _MAX_STATIONARITY
        usable = exact and self._ready >= 0 and not len(self._problem.bounded)
        return self._closed if usable else None

    def solve(self, f: Array, lower: Array | None = None, upper: Array | None = None) -> QpSolution:
        """See `Solver`."""
        if self._ready < 0:  # contradictory bounds are detected at set-up
            return no_solution(self._problem, _DAQP_STATUS.get(self._ready, "failed"))
        if not math.isfinite(f @ f):
            return no_solution(self._problem, "not-finite")
        low = self._problem.lower if lower is None else lower
        high = self._problem.upper if upper is None else upper
        closed = self.closed_form
        if closed is not None:
            x, inside = minimise_freely(closed.minus_inverse, f, low, high, self._problem.slope)
            if inside:
                return QpSolution(SOLVED, x, self._free, closed.residuals, 0)
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
    def closed_form(self) -> ClosedForm | None:
        """See `Solver`; None, so that OSQP gives every answer, as in the paper."""
        return None

    def solve(self, f: Array, lower: Array | None = None, upper: Array | None = None) -> QpSolution:
        if not np.isfinite(f).all():
            return no_solution(self._problem, "not-finite")
        low = self._problem.lower if lower is None else lower
        high = self._problem.upper if upper is None else upper
        if (low > high).any():
            return no_solution(self._problem, "infeasible")
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
            max_iter=20000,
            adaptive_rho=1,
            adaptive_rho_interval=50,  # by iterations, never by time
        )
        result = solver.solve(raise_error=False)
        info = result.info
        status = "infeasible" if info.status_val in _OSQP_INFEASIBLE else info.status
        status = status.replace(" ", "-")
        return judge(self._problem, f, result.x, result.y, status, int(info.iter), low, high)


@compiled
def minimise_freely(
    minus_inverse: Array, f: Array, lower: Array, upper: Array, slope: float
) -> tuple[Array, bool]:
    """The unconstrained minimiser x, and whether box and pyramid hold at it."""
    x = minus_inverse @ f
    inside = True
    for i in range(len(x)):
        inside = inside and lower[i] <= x[i] <= upper[i]
    for foot in range(len(x) // 3):
        limit = upper[len(x) + 4 * foot] + slope * x[3 * foot + 2]
        inside = inside and abs(x[3 * foot]) <= limit and abs(x[3 * foot + 1]) <= limit
    return x, inside


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
    if not (checked.primal <= _MAX_VIOLATION and checked.stationarity <= _MAX_STATIONARITY):
        return replace(no_solution(problem, "inaccurate"), residuals=checked)
    return QpSolution(SOLVED, v, multipliers, checked, iterations)


def residuals(
    problem: PlannerProblem,
    f: Array,
    v: Array,
    multipliers: Array,
    lower: Array | None = None,
    upper: Array | None = None,
) -> Residuals:
    """Karush-Kuhn-Tucker residuals; positive multipliers belong to upper bounds."""
    low = problem.lower if lower is None else lower
    high = problem.upper if upper is None else upper
    values = np.concatenate([v, problem.A @ v])
    pull = problem.A.T @ multipliers[len(v) :]
    return Residuals(*_largest(problem.H @ v, f, pull, values, multipliers, low, high))


@compiled
def _largest(
    Hv: Array, f: Array, pull: Array, values: Array, multipliers: Array, low: Array, high: Array
) -> tuple[float, float, float]:
    """The figures of `Residuals` from H v, Aᵀ λ_A and [v; A v]; NaN if a number is."""
    off = bent = asked = pulled = beyond = loose = 0.0
    for i in range(len(Hv)):
        total = multipliers[i] + pull[i]
        off = _worse(off, abs(Hv[i] + f[i] + total))
        bent, asked = _worse(bent, abs(Hv[i])), _worse(asked, abs(f[i]))
        pulled = _worse(pulled, abs(total))
    for i in range(len(values)):
        beyond = _worse(_worse(beyond, values[i] - high[i]), low[i] - values[i])
        if multipliers[i] != 0.0:
            bound = high[i] if multipliers[i] > 0.0 else low[i]
            loose = _worse(loose, abs(multipliers[i] * (values[i] - bound)))
    scale = max(1.0, bent, asked, pulled)
    return off / scale, beyond, loose / scale


@compiled
def _worse(a: float, b: float) -> float:
    """The larger of two numbers, NaN if one is."""
    return b if b > a or b != b else a
