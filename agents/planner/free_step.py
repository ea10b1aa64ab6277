"""A planning step whose optimum touches no bound, as one compiled call: most steps are such.

Between two steps the processor's caches are lost, so that what a step costs is mostly how much
code and memory it goes through. The same arithmetic as `Planner.step` goes through otherwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import NOMINAL_FORCES
from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.agents.planner.qp_solver import ClosedForm, unconstrained
from quadriga.agents.plausibility import OUTPUT_MAX
from quadriga.shared.robot.a1 import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled


class FreeStep:
    """The set-up of one stance pattern of the horizon, N samples long.

    Args:
        problem: the QP; no bound of it depends on the free response.
        closed: its closed form.
        nominal: nominal forces of the horizon, (N, 12), N.
    """

    def __init__(self, problem: PlannerProblem, closed: ClosedForm, nominal: Array) -> None:
        self.residuals = closed.residuals
        condensed = problem.condensed
        self._fixed = (
            condensed.Y_past, problem.gradient, closed.minus_inverse, problem.lower, problem.upper,
            problem.slope, condensed.Y_v, problem.columns, nominal, NOMINAL_FORCES,
        )  # fmt: skip

    def plan(
        self,
        u_ini: Array,
        y_ini: Array,
        stance_ini: NDArray[np.bool_],
        y_base_ini: Array,
        y_base: Array,
        y_des: Array,
        effect: Array | float,
    ) -> tuple[Array, Array, Array, Array] | None:
        """The plan of `PlannerInputs` and the effect of `PeerTerms`.

        Returns:
            u, du, y and y_nominal of `PlanResult`; None where a bound is active or an output is
            implausible.
        """
        forces, outputs, inside = _free_step(
            u_ini, y_ini, stance_ini, y_base_ini, y_base, y_des, effect, *self._fixed
        )
        return (forces[0], forces[1], outputs[0], outputs[1]) if inside else None


@compiled
def _free_step(
    u_ini: Array,
    y_ini: Array,
    stance_ini: NDArray[np.bool_],
    y_base_ini: Array,
    y_base: Array,
    y_des: Array,
    effect: Array | float,
    Y_past: Array,
    gradient: Array,
    minus_inverse: Array,
    lower: Array,
    upper: Array,
    slope: float,
    Y_v: Array,
    columns: NDArray[np.int64],
    nominal: Array,
    nominal_table: Array,
) -> tuple[Array, Array, bool]:
    """Forces u and du, (2, N, 12); outputs y and y_nominal, (2, N, 6); is the plan usable?"""
    T_ini, N = len(u_ini), len(y_des)
    past = np.empty(T_ini * (N_FORCES + N_OUTPUTS))
    for k in range(T_ini):
        pattern = 0
        for leg in range(4):
            pattern = 2 * pattern + stance_ini[k, leg]
        past[N_FORCES * k : N_FORCES * (k + 1)] = u_ini[k] - nominal_table[pattern]
        at = N_FORCES * T_ini + N_OUTPUTS * k
        past[at : at + N_OUTPUTS] = y_ini[k] - y_base_ini[k]
    y_free = Y_past @ past + effect
    error = y_free - (y_des - y_base).ravel()
    x, inside = unconstrained(minus_inverse, gradient @ error, lower, upper, slope)
    forces, outputs = np.zeros((2, N, N_FORCES)), np.empty((2, N, N_OUTPUTS))
    du = forces[1].ravel()
    for i in range(len(columns)):
        du[columns[i]] = x[i]
    forces[0] = nominal + forces[1]
    outputs[0] = y_base + (y_free + Y_v @ x).reshape(N, N_OUTPUTS)
    outputs[1] = y_base + y_free.reshape(N, N_OUTPUTS)
    for output in outputs.flat:
        if not abs(output) <= OUTPUT_MAX:
            inside = False
    return forces, outputs, inside
