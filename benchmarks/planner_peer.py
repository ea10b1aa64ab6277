"""Eq. 5 as a user of CVXPY writes it, the usual tool to try DeePC with.

`pip install cvxpy` makes it available; it is no dependency of the project.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from benchmarks.as_written import force_bounds
from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE, Episode, team_layout
from quadriga.agents.predictor.hankel import split
from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.robots.conventions import Array

AVAILABLE = find_spec("cvxpy") is not None


class CvxpyDeepc:
    """One robot's DeePC; what changes is a parameter, so that CVXPY compiles the problem once.

    Args:
        config: horizons, weights, friction and bounds.
        episodes: data of one robot.
    """

    def __init__(self, config: PlannerConfig, episodes: Sequence[Episode]) -> None:
        import cvxpy as cp

        layout = team_layout(1, config.T_ini, config.N)
        u, y = zip(*(episode.scaled_deviations(layout) for episode in episodes), strict=True)
        U_p, Y_p, U_f, Y_f = split(u, y, config.T_ini, config.N)
        N, rows = config.N, len(Y_p)
        self._u_ini, self._y_ini = cp.Parameter(len(U_p)), cp.Parameter(rows)
        self._y_des, self._nominal = cp.Parameter(6 * N), cp.Parameter((4 * N, 3))
        self._box_low, self._box_high = cp.Parameter((4 * N, 3)), cp.Parameter((4 * N, 3))
        self._config = config
        g, sigma = cp.Variable(U_p.shape[1]), cp.Variable(rows)
        self._u, y_f = cp.Variable((4 * N, 3)), cp.Variable(6 * N)
        flat = cp.reshape(self._u, 12 * N, order="C")
        force, c = self._u + self._nominal, config.mu / np.sqrt(2.0)
        cost = (
            cp.sum_squares(cp.multiply(np.sqrt(np.tile(config.Q, N)), y_f - self._y_des))
            + cp.sum_squares(cp.multiply(np.sqrt(np.tile(config.R, 4 * N)), flat))
            + config.lambda_g * cp.sum_squares(g)
            + config.lambda_sigma * cp.sum_squares(sigma)
        )
        self._problem = cp.Problem(
            cp.Minimize(cost),
            [
                U_p @ g == self._u_ini,
                Y_p @ g + sigma == self._y_ini,
                U_f @ g == flat / U_SCALE,
                Y_f @ g == cp.multiply(1.0 / np.tile(Y_SCALE, N), y_f),
                self._u >= self._box_low,
                self._u <= self._box_high,
                cp.abs(force[:, 0]) <= c * force[:, 2],
                cp.abs(force[:, 1]) <= c * force[:, 2],
            ],
        )

    def solve(self, past: Array, y_des: Array, stance: NDArray[np.bool_], nominal: Array) -> Array:
        """Force deviations (12 N,) with CVXPY's choice of solver and settings."""
        count = 12 * self._config.T_ini
        self._u_ini.value = past[:count] / U_SCALE
        self._y_ini.value = past[count:] / np.tile(Y_SCALE, self._config.T_ini)
        self._y_des.value, self._nominal.value = y_des, nominal.reshape(-1, 3)
        low, high = force_bounds(self._config, stance, nominal)
        self._box_low.value = low[: nominal.size].reshape(-1, 3)
        self._box_high.value = high[: nominal.size].reshape(-1, 3)
        self._problem.solve(warm_start=True)
        u: Array = self._u.value.ravel()
        return u
