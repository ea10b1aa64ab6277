"""How well an answer to a QP fulfils the Karush-Kuhn-Tucker conditions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

# An answer with larger residuals is not used, whatever status the solver reports.
MAX_VIOLATION: Final = 1e-5  # N
MAX_STATIONARITY: Final = 1e-5  # relative to the terms of the gradient


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


@compiled
def is_optimal(primal: float, stationarity: float) -> bool:
    """Whether an answer with these residuals is used; not if one is NaN."""
    return primal <= MAX_VIOLATION and stationarity <= MAX_STATIONARITY


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
    return Residuals(*largest_residuals(problem.H @ v, f, pull, values, multipliers, low, high))


@compiled
def largest_residuals(
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
