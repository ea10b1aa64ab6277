"""A planning step whose optimum lies on no bound, as most do, computed in one compiled call.

The processor's caches are lost between two steps, so a step takes mostly the time to load its code
and data. The arithmetic is that of `Planner.step` with a solver.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.agents.planner.qp_solver import ClosedForm, minimise_freely
from quadriga.agents.plausibility import OUTPUT_MAX
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled


class OwnWindow(NamedTuple):
    """The agent's own data for a step; see `PlannerInputs`."""

    u_ini: Array
    y_ini: Array
    stance_ini: NDArray[np.bool_]
    y_base_ini: Array
    y_base: Array
    y_des: Array


class _Prediction(NamedTuple):
    """y = Y_past past + effect + Y_v v, v in `columns` of the forces."""

    Y_past: Array
    Y_v: Array
    columns: NDArray[np.int64]
    nominal: Array  # forces of the horizon, (N, 12), N
    nominal_table: Array  # forces by stance pattern, (16, 12), N


class _Minimiser(NamedTuple):
    """v = −H⁻¹ G_uᵀ Q̄ (y_free − y_des), valid inside the box and the friction pyramid."""

    gradient: Array
    minus_inverse: Array
    lower: Array
    upper: Array
    slope: float


class FreePlan(NamedTuple):
    """u, du, (N, 12), and y, y_nominal, (N, 6), of `PlanResult`."""

    u: Array
    du: Array
    y: Array
    y_nominal: Array


class FreeStep:
    """The set-up of one stance pattern of the horizon, N samples long.

    Args:
        problem: the QP; no bound of it depends on the free response.
        closed: its closed form.
        nominal: nominal forces of the horizon, (N, 12), N.
        table: `nominal_table` of the robot.
    """

    def __init__(
        self, problem: PlannerProblem, closed: ClosedForm, nominal: Array, table: Array
    ) -> None:
        self.residuals = closed.residuals
        condensed = problem.condensed
        self._prediction = _Prediction(
            condensed.Y_past, condensed.Y_v, problem.columns, nominal, table
        )
        self._minimiser = _Minimiser(
            problem.gradient, closed.minus_inverse, problem.lower, problem.upper, problem.slope
        )

    def plan(self, own: OwnWindow, effect: Array | float) -> FreePlan | None:
        """The plan; None where a bound is active or an output is implausible.

        Args:
            own: the agent's own data for the step.
            effect: of the peers on its outputs, see `PeerTerms`.
        """
        if not isinstance(effect, np.ndarray):  # one type: machine code is made for each
            effect = np.full(len(self._prediction.Y_past), effect)
        forces, outputs, usable = _free_step(own, effect, self._prediction, self._minimiser)
        return FreePlan(forces[0], forces[1], outputs[0], outputs[1]) if usable else None


@compiled
def _free_step(
    own: OwnWindow, effect: Array, prediction: _Prediction, minimiser: _Minimiser
) -> tuple[Array, Array, bool]:
    """Forces u and du, (2, N, 12); outputs y and y_nominal, (2, N, 6); is the plan usable?"""
    # Unpacked before the loops: each access to a tuple in a loop costs a reference count.
    u_ini, y_ini, stance_ini, y_base_ini, y_base, y_des = own
    Y_past, Y_v, columns, nominal, nominal_table = prediction
    gradient, minus_inverse, lower, upper, slope = minimiser
    N = len(y_des)
    past = past_deviations(u_ini, y_ini, stance_ini, y_base_ini, nominal_table)
    y_free = Y_past @ past + effect
    error = y_free - (y_des - y_base).ravel()
    x, usable = minimise_freely(minus_inverse, gradient @ error, lower, upper, slope)
    forces, outputs = np.zeros((2, N, N_FORCES)), np.empty((2, N, N_OUTPUTS))
    du = forces[1].ravel()
    for i in range(len(columns)):
        du[columns[i]] = x[i]
    forces[0] = nominal + forces[1]
    outputs[0] = y_base + (y_free + Y_v @ x).reshape(N, N_OUTPUTS)
    outputs[1] = y_base + y_free.reshape(N, N_OUTPUTS)
    for output in outputs.flat:
        if not abs(output) <= OUTPUT_MAX:
            usable = False
    return forces, outputs, usable


@compiled
def past_deviations(
    u_ini: Array,
    y_ini: Array,
    stance_ini: NDArray[np.bool_],
    y_base_ini: Array,
    nominal_table: Array,
) -> Array:
    """Deviations [u_ini; y_ini] as `PlannerInputs.past` has them. Shape (18 T_ini,)."""
    T_ini = len(u_ini)
    past = np.empty(T_ini * (N_FORCES + N_OUTPUTS))
    for k in range(T_ini):
        pattern = 0
        for leg in range(4):
            pattern = 2 * pattern + stance_ini[k, leg]
        past[N_FORCES * k : N_FORCES * (k + 1)] = u_ini[k] - nominal_table[pattern]
        at = N_FORCES * T_ini + N_OUTPUTS * k
        past[at : at + N_OUTPUTS] = y_ini[k] - y_base_ini[k]
    return past
