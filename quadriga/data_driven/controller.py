"""Predictive control with a fitted predictor (eq. 7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.regression import scaled_blocks
from quadriga.data_driven.bounded_qp import BoundedQp
from quadriga.data_driven.fitted_predictor import FittedPredictor
from quadriga.data_driven.plan import (
    DEFAULT_WEIGHTS,
    UNBOUNDED,
    DataDrivenPlan,
    PlanBounds,
    PlanWeights,
    Request,
)
from quadriga.data_driven.signals import unstack
from quadriga.shared.robot.conventions import Array


@dataclass(frozen=True, slots=True, eq=False)
class PhaseProblem:
    """The QP of one phase, in scaled inputs and outputs.

    Attributes:
        G_past: columns that multiply the past, shape (n p N, n (m + p) T_ini).
        G_u: columns that multiply the inputs of the horizon, shape (n p N, n m N).
        gradient: G_uᵀ Q.
        qp: with the Hessian G_uᵀ Q G_u + R.
    """

    G_past: Array
    G_u: Array
    gradient: Array
    qp: BoundedQp


class DataDrivenController:
    """min Σ ‖y − r‖²_Q + ‖u − r_u‖²_R with y = G [u_ini; y_ini; u], and bounds on u and y (eq. 7).

    Args:
        predictor: of the plant, of any kind.
        weights: Q and R.
        bounds: of inputs and of predicted outputs.

    Raises:
        PredictorError: weights that are not positive, or bounds of another plant.
    """

    def __init__(
        self,
        predictor: FittedPredictor,
        weights: PlanWeights = DEFAULT_WEIGHTS,
        bounds: PlanBounds = UNBOUNDED,
    ) -> None:
        layout = predictor.layout
        self._predictor = predictor
        Q, R = weights.stages(layout)
        steps = layout.agents * layout.N
        self._Q = np.tile(Q * np.array(layout.y_scale) ** 2, steps)
        self._R = np.tile(R * np.array(layout.u_scale) ** 2, steps)
        u_low, u_high = bounds.inputs(layout)
        y_low, y_high = bounds.outputs(layout)
        self._rows = np.flatnonzero(np.isfinite(y_low) | np.isfinite(y_high))
        self._lower = np.concatenate([u_low, y_low[self._rows]])
        self._upper = np.concatenate([u_high, y_high[self._rows]])
        self._problems = [self._build(phase) for phase in range(predictor.period)]

    def plan(
        self,
        past_u: ArrayLike,
        past_y: ArrayLike,
        reference: ArrayLike,
        input_reference: ArrayLike | None = None,
        phase: int = 0,
    ) -> DataDrivenPlan:
        """The best inputs of the horizon.

        Args:
            past_u: the last T_ini inputs, oldest first, shape (T_ini, m), or (T_ini, n, m).
            past_y: the outputs that belong to them, shape (T_ini, p), or (T_ini, n, p).
            reference: r, of the outputs, shape (N, p), or (p,) for the whole horizon; of n agents
                (N, n, p) or (n, p).
            input_reference: r_u, likewise of the inputs; zero if left out.
            phase: time index of the horizon's first sample, of a periodic plant.

        Raises:
            PredictorError: another shape, numbers that are not finite, or bounds that nothing
                keeps.
        """
        predictor, layout = self._predictor, self._predictor.layout
        given = Request.of(
            layout, (past_u, past_y), reference, input_reference, single=predictor.single
        )
        problem = self._problems[phase % predictor.period]
        past = np.concatenate(
            [part.reshape(layout.agents, -1) for part in (given.u_ini, given.y_ini)], axis=1
        )
        free = problem.G_past @ past.ravel()
        f = problem.gradient @ (free - given.reference) - self._R * given.input_reference
        shift = np.concatenate([np.zeros(len(f)), free[self._rows]])
        u, residual = problem.qp.solve(f, self._lower - shift, self._upper - shift)
        y = free + problem.G_u @ u
        signals = [
            unstack(vector, layout.agents, len(scale), single=predictor.single) * np.array(scale)
            for vector, scale in ((u, layout.u_scale), (y, layout.y_scale))
        ]
        return DataDrivenPlan(signals[0], signals[1], None, None, residual)

    def _build(self, phase: int) -> PhaseProblem:
        layout = self._predictor.layout
        G = scaled_blocks(self._predictor.blocks[phase], layout)
        whole = G.transpose(0, 2, 1, 3)  # agent, its outputs, agent, its columns
        rows = layout.agents * layout.rows
        G_past = np.ascontiguousarray(whole[..., : layout.past]).reshape(rows, -1)
        G_u = np.ascontiguousarray(whole[..., layout.past :]).reshape(rows, -1)
        gradient = G_u.T * self._Q
        H = gradient @ G_u
        H.flat[:: len(H) + 1] += self._R
        return PhaseProblem(G_past, G_u, gradient, BoundedQp(H, G_u[self._rows]))
