"""A planning step that limits forces alone, computed in one compiled call.

The processor's caches are lost between two steps, so a step takes mostly the time to load its code
and data. The arithmetic is that of `Planner.step` with a solver.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.foot_limits import FAILED, ForceQp, minimise_freely, minimise_within
from quadriga.agents.planner.optimality import Residuals, is_optimal
from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.agents.planner.qp_solver import CompiledQp
from quadriga.agents.plausibility import OUTPUT_MAX
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
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
    """y = Y_past past + effect + Y_v v, v in `columns` of the forces, and f = gradient · error."""

    gradient: Array
    Y_past: Array
    Y_v: Array
    columns: NDArray[np.int64]
    nominal: Array  # forces of the horizon, (N, 12), N
    nominal_table: Array  # forces by stance pattern, (16, 12), N


class CompiledPlan(NamedTuple):
    """The plan of a step.

    Attributes:
        u, du: (N, 12), see `PlanResult`.
        y, y_nominal: (N, 6).
        residuals: of the QP's solution.
        iterations: QPs solved on faces of the limits; 0 where no limit is active.
    """

    u: Array
    du: Array
    y: Array
    y_nominal: Array
    residuals: Residuals
    iterations: int


class CompiledStep:
    """The set-up of one stance pattern of the horizon, N samples long.

    Args:
        problem: the QP; no bound of it depends on the free response.
        compiled_qp: the same for compiled code.
        nominal: nominal forces of the horizon, (N, 12), N.
        table: `nominal_table` of the robot.
        kept: share of its last plan that the plan keeps.
    """

    def __init__(
        self,
        problem: PlannerProblem,
        compiled_qp: CompiledQp,
        nominal: Array,
        table: Array,
        kept: float = 0.0,
    ) -> None:
        self._free_residuals, self._qp, self._kept = compiled_qp.residuals, compiled_qp.qp, kept
        condensed = problem.condensed
        self._prediction = _Prediction(
            problem.gradient, condensed.Y_past, condensed.Y_v, problem.columns, nominal, table
        )

    def plan(self, own: OwnWindow, effect: Array | float, last: Array) -> CompiledPlan | None:
        """The plan; None where the QP is not solved or an output is implausible.

        Args:
            own: the agent's own data for the step.
            effect: of the peers on its outputs, see `PeerTerms`.
            last: deviations of the QP's forces in the last plan, (nv,), N.
        """
        if not isinstance(effect, np.ndarray):  # one type: machine code is made for each
            effect = np.full(len(self._prediction.Y_past), effect)
        forces, outputs, proof, solutions = _step(
            own, effect, last, self._kept, self._prediction, self._qp
        )
        if solutions == FAILED:
            return None
        residuals = Residuals(*proof) if solutions else self._free_residuals
        return CompiledPlan(forces[0], forces[1], outputs[0], outputs[1], residuals, solutions)


@compiled
def _step(
    own: OwnWindow, effect: Array, last: Array, kept: float, prediction: _Prediction, qp: ForceQp
) -> tuple[Array, Array, tuple[float, float, float], int]:
    """Forces u and du, (2, N, 12); outputs y and y_nominal, (2, N, 6); residuals; solutions."""
    # Unpacked before the loops: each access to a tuple in a loop costs a reference count.
    u_ini, y_ini, stance_ini, y_base_ini, y_base, y_des = own
    gradient, Y_past, Y_v, columns, nominal, nominal_table = prediction
    N = len(y_des)
    past = past_deviations(u_ini, y_ini, stance_ini, y_base_ini, nominal_table)
    y_free = Y_past @ past + effect
    f = gradient @ (y_free - (y_des - y_base).ravel())
    x, inside = minimise_freely(qp, f)
    proof, solutions = (0.0, 0.0, 0.0), 0
    if not inside:
        solutions = FAILED
        if np.isfinite(np.dot(f, f)):
            found = minimise_within(qp, f, x)
            x, proof = found.v, (found.stationarity, found.primal, found.complementarity)
            if is_optimal(found.primal, found.stationarity):
                solutions = found.solutions
    if kept:
        x = (1.0 - kept) * x + kept * last
    forces, outputs = np.zeros((2, N, N_FORCES)), np.empty((2, N, N_OUTPUTS))
    du = forces[1].ravel()
    for i in range(len(columns)):
        du[columns[i]] = x[i]
    forces[0] = nominal + forces[1]
    outputs[0] = y_base + (y_free + Y_v @ x).reshape(N, N_OUTPUTS)
    outputs[1] = y_base + y_free.reshape(N, N_OUTPUTS)
    for output in outputs.flat:
        if not abs(output) <= OUTPUT_MAX:
            solutions = FAILED
    return forces, outputs, proof, solutions


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
