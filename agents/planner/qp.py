"""The planner's QP, condensed to the force deviations of stance legs, for one agent or a team.

    min_v ½ vᵀ H v + fᵀ v,   f = F_past past + F_des y_des,   y = Y_past past + Y_v v + Y_des y_des

The outputs are eliminated; swing legs carry no force and are left out, which is exact. Every
formulation (local eq. 12, centralised eq. 7, DeePC eq. 5) is such a `Condensed` problem, and only
`past` and `y_des` change from tick to tick, so everything else is built once per stance pattern.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import nominal_forces
from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled

NO_BOUNDS: Final = "none"
# An answer with larger residuals is not used, whatever status the solver reports.
MAX_VIOLATION: Final = 1e-5  # N
MAX_STATIONARITY: Final = 1e-5  # relative to the terms of the gradient


@dataclass(frozen=True, slots=True)
class Condensed:
    """Cost and prediction as functions of v, the past and the desired output deviations.

    P is the length of the past [u_ini; y_ini] (of all robots in a team's problem), p N that of
    the outputs over the horizon, nv = 3 · (stance legs over the horizon).

    Attributes:
        H: shape (nv, nv).
        F_past: shape (nv, P).
        F_des: shape (nv, p N).
        Y_v: shape (p N, nv).
        Y_past: shape (p N, P).
        Y_des: effect of y_des on the predicted outputs, shape (p N, p N); None if there is none, as
            in every formulation with a transition matrix.
    """

    H: Array
    F_past: Array
    F_des: Array
    Y_v: Array
    Y_past: Array
    Y_des: Array | None = None

    def free(self, past: Array, y_des: Array) -> Array:
        """Predicted output deviations with v = 0. Shape (p N,)."""
        y: Array = self.Y_past @ past
        return y if self.Y_des is None else y + self.Y_des @ y_des


@dataclass(frozen=True, slots=True)
class PlannerProblem:
    """The QP of one stance pattern in v.

    Attributes:
        condensed: cost and prediction.
        columns: place of each v in the stacked forces, shape (nv,).
        A: rows of the friction cone, then of the output bounds, shape (m, nv).
        lower, upper: bounds of [v; A v], shape (nv + m,); those of the output rows hold for a free
            response that equals y_des.
        bounded: places of the outputs that the output rows bound, shape (mo,).
        slope: c of the friction pyramid |fx|, |fy| ≤ c fz.
    """

    condensed: Condensed
    columns: NDArray[np.int64]
    A: Array
    lower: Array
    upper: Array
    bounded: NDArray[np.int64]
    slope: float

    @property
    def H(self) -> Array:
        """The cost's Hessian, shape (nv, nv)."""
        return self.condensed.H

    @property
    def gradient(self) -> Array:
        """Of a problem with a transition matrix: G_uᵀ Q̄, so that f = G_uᵀ Q̄ (y_free − y_des)."""
        return -self.condensed.F_des

    def linear_term(self, past: Array, y_des: Array) -> Array:
        """The linear term f of the cost, shape (nv,)."""
        f: Array = self.condensed.F_past @ past + self.condensed.F_des @ y_des
        return f

    def shifted(self, error: Array | None) -> PlannerProblem:
        """With bounds for a free response that is off y_des by `error`, shape (p N,)."""
        if not len(self.bounded) or error is None:
            return self
        shift = np.zeros(len(self.lower))
        shift[-len(self.bounded) :] = error[self.bounded]
        return replace(self, lower=self.lower - shift, upper=self.upper - shift)


def condense(
    config: PlannerConfig, G_past: Array, G_u: Array, stance: NDArray[np.bool_]
) -> Condensed:
    """The problem of a transition matrix: H = G_uᵀ Q̄ G_u + R̄, f = G_uᵀ Q̄ (G_past past − y_des).

    Args:
        config: weights.
        G_past: columns that multiply the past, shape (6 N n, P), robots stacked; one agent: n = 1.
        G_u: columns that multiply the future forces, shape (6 N n, 12 N n).
        stance: scheduled stance over the horizon, robots stacked, shape (N n, 4).
    """
    columns = stance_columns(stance)
    G = np.ascontiguousarray(G_u[:, columns])
    gradient = np.ascontiguousarray(G.T * np.tile(config.Q, len(stance)))
    H = gradient @ G
    H = 0.5 * (H + H.T)
    H.flat[:: len(H) + 1] += np.tile(config.R, len(columns) // 3)
    return Condensed(H, gradient @ G_past, -gradient, G, np.ascontiguousarray(G_past))


def build_problem(
    config: PlannerConfig,
    weight: float,
    G_u: Array,
    stance: NDArray[np.bool_],
    G_past: Array | None = None,
) -> PlannerProblem:
    """The QP of eq. 12 (one agent) or eq. 7 (a team) for one stance pattern of the horizon.

    See `condense`; `weight` is that of one robot, N, and G_past None leaves the past out.
    """
    past = np.zeros((len(G_u), 0)) if G_past is None else G_past
    return constrain(config, weight, condense(config, past, G_u, stance), stance)


def constrain(
    config: PlannerConfig, weight: float, condensed: Condensed, stance: NDArray[np.bool_]
) -> PlannerProblem:
    """Add friction cone, force bounds and output bounds to a cost.

    The friction cone is replaced by a pyramid inside it, |fx|, |fy| ≤ c fz with c = mu/√2. With
    f = nominal + v that is ±v_x − c v_z ≤ c nominal_z. Outputs are bounded in their deviation from
    the desired ones.
    """
    columns = stance_columns(stance)
    feet = len(columns) // 3
    c = config.mu / np.sqrt(2.0)
    pyramid = np.array([[1.0, 0.0, -c], [-1.0, 0.0, -c], [0.0, 1.0, -c], [0.0, -1.0, -c]])
    nominal_z = nominal_forces(stance, weight).ravel()[columns[2::3]]
    box = np.tile(config.deviation_max, feet)
    low = -box
    low[2::3] = np.maximum(low[2::3], config.force_min - nominal_z)
    A = np.kron(np.eye(feet), pyramid)
    lower, upper = [low, np.full(4 * feet, -np.inf)], [box, np.repeat(c * nominal_z, 4)]
    bounded = np.zeros(0, dtype=np.int64)
    if config.output_bounds != NO_BOUNDS:
        limit = np.tile(config.output_max, len(stance))
        bounded = np.flatnonzero(np.isfinite(limit))
        A = np.concatenate([A, condensed.Y_v[bounded]])
        lower.append(-limit[bounded])
        upper.append(limit[bounded])
    bounds = np.concatenate(lower), np.concatenate(upper)
    return PlannerProblem(condensed, columns, A, *bounds, bounded, c)


def stance_columns(stance: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Places of the stance legs' forces in the stacked forces (time, leg, axis)."""
    return np.flatnonzero(np.repeat(stance, 3, axis=1))


def unpack(problem: PlannerProblem, v: Array, y_free: Array) -> tuple[Array, Array]:
    """Force deviations (N n, 12), swing legs zero, and output deviations (N n, 6) of a solution."""
    dy = y_free + problem.condensed.Y_v @ v
    du = np.zeros(len(dy) // N_OUTPUTS * N_FORCES)
    du[problem.columns] = v
    return du.reshape(-1, N_FORCES), dy.reshape(-1, N_OUTPUTS)


class Residuals(NamedTuple):
    """How well the Karush-Kuhn-Tucker conditions hold.

    Attributes:
        stationarity: ‖H v + f + λ_box + Aᵀ λ_A‖∞ over the largest of its terms (at least 1).
        primal: largest violation of a bound [N].
        complementarity: largest |λ · distance to its bound|, over the same terms [N].
    """

    stationarity: float
    primal: float
    complementarity: float


@compiled
def is_optimal(found: Residuals) -> bool:
    """Whether an answer with these residuals is used; not if one is NaN."""
    return found.primal <= MAX_VIOLATION and found.stationarity <= MAX_STATIONARITY


def residuals(problem: PlannerProblem, f: Array, v: Array, multipliers: Array) -> Residuals:
    """Karush-Kuhn-Tucker residuals of an answer v; positive multipliers belong to upper bounds."""
    values = np.concatenate([v, problem.A @ v])
    pull, bounds = problem.A.T @ multipliers[len(v) :], (problem.lower, problem.upper)
    return largest_residuals(problem.H @ v, f, pull, values, multipliers, *bounds)


@compiled
def largest_residuals(
    Hv: Array, f: Array, pull: Array, values: Array, multipliers: Array, low: Array, high: Array
) -> Residuals:
    """Residuals from H v, Aᵀ λ_A and [v; A v]; NaN if a number is."""
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
    return Residuals(off / scale, beyond, loose / scale)


@compiled
def _worse(a: float, b: float) -> float:
    """The larger of two numbers, NaN if one is."""
    return b if b > a or b != b else a
