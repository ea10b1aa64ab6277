"""A fitted predictor: G and what it was fitted for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.layout import Layout
from quadriga.data_driven.signals import as_signal, unstack
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


@dataclass(frozen=True, slots=True, eq=False)
class FittedPredictor:
    """y^i = Σ_j G_ij [u_ini^j; y_ini^j; u^j], in the units of the data (eq. 6, 9).

    Attributes:
        kind: name of the fit, see `fit`.
        layout: sizes, and the scales of the data that it was fitted to.
        blocks: G_ij, shape (P, n, n, p N, W) with W = (m + p) T_ini + m N, read-only, for each of
            P samples of a period; P = 1 unless it is periodic. Rows and columns are time-major.
        single: whether signals have no axis of agents.
        condition: number of the regression, penalty included; None: unknown.
    """

    kind: str
    layout: Layout
    blocks: Array
    single: bool
    condition: float | None = None

    def __post_init__(self) -> None:
        n = self.layout.agents
        expected = (n, n, self.layout.rows, self.layout.width)
        if self.blocks.shape[1:] != expected or not len(self.blocks):
            raise PredictorError(
                "predictor.blocks", f"shape {self.blocks.shape}", f"(P, …{expected})"
            )
        self.blocks.setflags(write=False)

    @property
    def past(self) -> int:
        """T_ini, samples of the past."""
        return self.layout.T_ini

    @property
    def horizon(self) -> int:
        """N, samples that it predicts."""
        return self.layout.N

    @property
    def period(self) -> int:
        """P, samples after which G repeats itself; 1 unless it is periodic."""
        return len(self.blocks)

    @property
    def G(self) -> Array:
        """The whole matrix of eq. 6, of a periodic plant that of phase 0; see `matrix`."""
        return self.matrix(0)

    def matrix(self, phase: int) -> Array:
        """G as one matrix, agents stacked. Shape (p N n, W n), columns [u_ini; y_ini; u] of each.

        Args:
            phase: time index of the horizon's first sample, modulo the period.
        """
        n, rows, W = self.layout.agents, self.layout.rows, self.layout.width
        blocks = self.blocks[phase % self.period]
        whole: Array = blocks.transpose(0, 2, 1, 3).reshape(n * rows, n * W)
        return whole

    def predict(
        self, past_u: ArrayLike, past_y: ArrayLike, future_u: ArrayLike, phase: int = 0
    ) -> Array:
        """Predicted outputs over the horizon.

        Args:
            past_u: the last T_ini inputs, oldest first, shape (T_ini, m), or (T_ini, n, m).
            past_y: the outputs that belong to them, shape (T_ini, p), or (T_ini, n, p).
            future_u: inputs of the horizon, shape (N, m), or (N, n, m).
            phase: time index of the horizon's first sample, of a periodic plant.

        Returns:
            Shape (N, p), or (N, n, p).

        Raises:
            PredictorError: another shape, or numbers that are not finite.
        """
        layout = self.layout
        n, m, p = layout.agents, layout.inputs, layout.outputs
        parts = [
            as_signal(name, signal, (samples, n, dim), single=self.single)
            for name, signal, samples, dim in (
                ("past_u", past_u, layout.T_ini, m),
                ("past_y", past_y, layout.T_ini, p),
                ("future_u", future_u, layout.N, m),
            )
        ]
        z = np.concatenate([part.transpose(1, 0, 2).reshape(n, -1) for part in parts], axis=1)
        return unstack(self.matrix(phase) @ z.ravel(), n, p, single=self.single)
