"""Data-enabled predictive control (eq. 5) of any plant, without forming a model."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.deepc import Reduction, input_output_rows, reduce_signals
from quadriga.agents.predictor.hankel import mosaic
from quadriga.data_driven.bounded_qp import BoundedQp
from quadriga.data_driven.excitation import check_excitation
from quadriga.data_driven.plan import (
    DEFAULT_WEIGHTS,
    UNBOUNDED,
    DataDrivenPlan,
    PlanBounds,
    PlanWeights,
    Request,
)
from quadriga.data_driven.signals import unstack
from quadriga.data_driven.trajectories import Data
from quadriga.shared.robot.conventions import Array


class Deepc:
    """min Σ ‖y − r‖²_Q + ‖u − r_u‖²_R + λ_g ‖g‖² + λ_σ ‖σ‖², with bounds on u and y (eq. 5).

    Subject to [U_p; Y_p; U_f; Y_f] g = [u_ini; y_ini + σ; u; y]. The problem is solved in u and z
    of the data's `Reduction`, as many as it has directions, instead of the g of all windows: g has
    no part outside the span of the data's rows, so this is exact, bounds on outputs included.

    Args:
        data: of the plant; episodes shorter than past + horizon are ignored.
        past: T_ini, samples that tell the plant's state.
        horizon: N, samples to plan.
        weights: with a small `lambda_g`, g chooses freely among what noisy data allow, and the
            prediction is drawn towards the reference.
        bounds: of inputs and of predicted outputs.

    Raises:
        PredictorError: too little data, inputs that do not excite, or weights that are not
            positive.
    """

    def __init__(
        self,
        data: Data,
        past: int,
        horizon: int,
        weights: PlanWeights = DEFAULT_WEIGHTS,
        bounds: PlanBounds = UNBOUNDED,
    ) -> None:
        layout = data.layout(past, horizon)
        check_excitation(data, past + horizon)
        signals = data.scaled(layout)
        reduction = reduce_signals(signals, layout)
        self._layout, self._single = layout, data.single
        n, N = layout.agents, layout.N
        past_u, self._past_y = n * layout.inputs * past, n * layout.outputs * past
        self._by_past = reduction.response[:, :past_u]
        self._by_x = np.hstack([reduction.response[:, past_u:], reduction.spread])

        Q, R = weights.stages(layout)
        y_square = np.array(layout.y_scale) ** 2
        Omega = np.concatenate(
            [np.tile(weights.lambda_sigma * y_square, n * past), np.tile(Q * y_square, n * N)]
        )
        self._R = np.tile(R * np.array(layout.u_scale) ** 2, n * N)
        effort = weights.lambda_g * reduction.inverse[past_u:]
        self._effort_past, k = effort[:, :past_u], len(effort)
        self._gradient = self._by_x.T * Omega
        H = self._gradient @ self._by_x
        H[:k, :k] += effort[:, past_u:]
        H.flat[:: len(H) + 1] += np.concatenate([self._R, np.full(len(H) - k, weights.lambda_g)])

        u_low, u_high = bounds.inputs(layout)
        y_low, y_high = bounds.outputs(layout)
        bounded = np.flatnonzero(np.isfinite(y_low) | np.isfinite(y_high))
        self._rows = self._past_y + bounded
        free = np.full(len(H) - k, np.inf)
        self._lower = np.concatenate([u_low, -free, y_low[bounded]])
        self._upper = np.concatenate([u_high, free, y_high[bounded]])
        self._qp = BoundedQp(H, self._by_x[self._rows])
        self._g_by_a, self._g_by_z = _combinations(signals, reduction)

    def plan(
        self,
        past_u: ArrayLike,
        past_y: ArrayLike,
        reference: ArrayLike,
        input_reference: ArrayLike | None = None,
    ) -> DataDrivenPlan:
        """The best inputs of the horizon.

        Args:
            past_u: the last T_ini inputs, oldest first, shape (T_ini, m), or (T_ini, n, m).
            past_y: the outputs that belong to them, shape (T_ini, p), or (T_ini, n, p).
            reference: r, of the outputs, shape (N, p), or (p,) for the whole horizon; of n agents
                (N, n, p) or (n, p).
            input_reference: r_u, likewise of the inputs; zero if left out.

        Raises:
            PredictorError: another shape, numbers that are not finite, or bounds that nothing
                keeps.
        """
        layout, past = self._layout, (past_u, past_y)
        given = Request.of(layout, past, reference, input_reference, single=self._single)
        past_part = self._by_past @ given.u_ini
        f = self._gradient @ (past_part - np.concatenate([given.y_ini, given.reference]))
        k = len(self._R)
        f[:k] += self._effort_past @ given.u_ini - self._R * given.input_reference
        shift = np.concatenate([np.zeros(len(f)), past_part[self._rows]])
        x, residual = self._qp.solve(f, self._lower - shift, self._upper - shift)
        outputs, u = past_part + self._by_x @ x, x[:k]
        sigma = outputs[: self._past_y] - given.y_ini
        g = self._g_by_a @ np.concatenate([given.u_ini, u]) + self._g_by_z @ x[k:]
        return DataDrivenPlan(
            self._signal(u, layout.u_scale),
            self._signal(outputs[self._past_y :], layout.y_scale),
            g,
            self._signal(sigma, layout.y_scale),
            residual,
        )

    def _signal(self, vector: Array, scale: tuple[float, ...]) -> Array:
        """A scaled vector as a signal in the units of the data."""
        scaled = unstack(vector, self._layout.agents, len(scale), single=self._single)
        signal: Array = scaled * np.array(scale)
        return signal


def _combinations(signals: list[Array], reduction: Reduction) -> tuple[Array, Array]:
    """Maps from [u_ini; u] and from z to g, which is their sum.

    With H_a and H_b the Hankel matrices of inputs and outputs, g = H_aᵀ S_aa⁻¹ a + Rᵀ M (MᵀM)⁻¹ z
    with R = H_b − Φ H_a: then H_a g = a and H_b g = Φ a + M z, and no g is shorter.
    """
    L = reduction.layout.T_ini + reduction.layout.N
    H = mosaic([w for w in signals if len(w) >= L], L)
    a, b = input_output_rows(reduction.layout)
    left = H[b] - reduction.response @ H[a]
    squares = (reduction.spread**2).sum(axis=0)
    return H[a].T @ reduction.inverse, left.T @ (reduction.spread / squares)
