"""The paper's problems as written there, solved by sparse OSQP; for comparison only.

Eq. 12 for one agent and eq. 7 for a whole team. Outputs stay variables, swing
legs are variables bounded to zero, and one solver object is updated and warm-started from tick to
tick, so an answer depends on the ticks before it. Forces and outputs are deviations, as in the
planner; the cost is halved and without its constant part.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse

from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array

Stance = NDArray[np.bool_]

# OSQP's own tolerances, and tighter ones for a reference; rho adapts by iterations, never by time.
DEFAULT: Final[Mapping[str, float]] = MappingProxyType(
    {"adaptive_rho": 1, "adaptive_rho_interval": 50}
)
TIGHT: Final[Mapping[str, float]] = MappingProxyType({
    "adaptive_rho": 1, "adaptive_rho_interval": 50,
    "eps_abs": 1e-9, "eps_rel": 1e-9, "polishing": 1, "max_iter": 100_000,
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Written:
    """An unchecked answer of OSQP.

    Attributes:
        u: force deviations, shape (n, N, 12), N.
        y: output deviations, shape (n, N, 6), m, m/s, rad, rad/s.
        status: as OSQP reports it; u and y may be NaN unless it is "solved".
    """

    u: Array
    y: Array
    status: str


class PaperQp:
    """Eq. 12 for one agent, eq. 7 for a team: variables u and y, y = G_u u + y_free.

    Args:
        config: N, weights, friction, bounds.
        G_u: effect of the forces of n robots on their outputs, shape (6 n N, 12 n N).
        settings: OSQP's.
    """

    def __init__(
        self, config: PlannerConfig, G_u: Array, settings: Mapping[str, float] = DEFAULT
    ) -> None:
        self._config = config
        outputs, forces = G_u.shape
        steps = forces // N_FORCES
        P = sparse.diags_array(np.concatenate([_R(config, steps), _Q(config, steps)]))
        rows: list[list[sparse.sparray | None]] = [
            [-sparse.csc_array(G_u), sparse.eye_array(outputs)],
            [_force_rows(config, steps), None],
        ]
        self._solver = WarmOsqp(P, sparse.block_array(rows), settings)
        self._forces = forces

    def solve(self, y_free: Array, y_des: Array, stance: Stance, nominal: Array) -> Written:
        """One tick.

        Args:
            y_free: outputs without future forces, per robot, shape (6 n N,).
            y_des: desired outputs, shape (6 n N,).
            stance: scheduled stance, shape (n, N, 4).
            nominal: forces that deviations are counted from, shape (n, N, 12), N.
        """
        lower, upper = _force_bounds(self._config, stance, nominal)
        Q = _Q(self._config, len(y_des) // N_OUTPUTS)
        x, status = self._solver.solve(
            np.concatenate([np.zeros(self._forces), -Q * y_des]),
            np.concatenate([y_free, lower]),
            np.concatenate([y_free, upper]),
        )
        return _unpack(x, stance, status)


class WarmOsqp:
    """One OSQP object: set up at the first tick, then updated; it warm-starts from its last x."""

    def __init__(self, P: sparse.sparray, A: sparse.sparray, settings: Mapping[str, float]) -> None:
        self._P, self._A = sparse.csc_matrix(P), sparse.csc_matrix(A)
        self._settings = settings
        self._model: osqp.OSQP | None = None

    def solve(self, q: Array, lower: Array, upper: Array) -> tuple[Array, str]:
        if (lower > upper).any():  # OSQP refuses such data instead of answering
            return np.full(len(q), np.nan), "primal infeasible"
        if self._model is None:
            self._model = osqp.OSQP()
            self._model.setup(self._P, q, self._A, lower, upper, verbose=False, **self._settings)
        else:
            self._model.update(q=q, l=lower, u=upper)  # unknown names are ignored
        result = self._model.solve(raise_error=False)
        return result.x, result.info.status


def _Q(config: PlannerConfig, steps: int) -> Array:
    return np.tile(config.Q, steps)


def _R(config: PlannerConfig, steps: int) -> Array:
    return np.tile(config.R, 4 * steps)


def _force_rows(config: PlannerConfig, steps: int) -> sparse.sparray:
    """Rows of all legs: the forces themselves, then ±f_x − c f_z and ±f_y − c f_z."""
    c = config.mu / np.sqrt(2.0)
    cone = np.array([[1.0, 0.0, -c], [-1.0, 0.0, -c], [0.0, 1.0, -c], [0.0, -1.0, -c]])
    feet = 4 * steps
    return sparse.vstack([sparse.eye_array(3 * feet), sparse.kron(sparse.eye_array(feet), cone)])


def _force_bounds(config: PlannerConfig, stance: Stance, nominal: Array) -> tuple[Array, Array]:
    """Bounds of `_force_rows`: a box and the friction cone in stance, exactly zero in swing."""
    vertical = nominal.reshape(*stance.shape, 3)[..., 2]
    box = np.where(stance[..., None], np.array(config.deviation_max), 0.0)
    lower = -box
    lower[..., 2] = np.where(stance, np.maximum(lower[..., 2], config.force_min - vertical), 0.0)
    cone = np.repeat((config.mu / np.sqrt(2.0) * vertical).ravel(), 4)
    return (
        np.concatenate([lower.ravel(), np.full(len(cone), -np.inf)]),
        np.concatenate([box.ravel(), cone]),
    )


def _unpack(x: Array, stance: Stance, status: str) -> Written:
    n, N, _ = stance.shape
    u, y, _ = np.split(x, [n * N * N_FORCES, n * N * (N_FORCES + N_OUTPUTS)])
    return Written(u.reshape(n, N, N_FORCES), y.reshape(n, N, N_OUTPUTS), status)
