"""A one-step model of the coupled team (ARX) rolled out over the horizon."""

from __future__ import annotations

import numpy as np

from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array


def roll_out(step: Array, meta: PredictorMeta) -> Array:
    """The N-step response from the one-step model of all robots.

    y_t = Σ_s (A_s y_{t−s} + B_s u_{t−s}) + B_0 u_t, s = 1 … T_ini, each y_{t−s} of the future
    replaced by its own prediction. With data from a feedback loop this is less biased than a fit
    over N steps: no future force that has answered to an output explains that output.

    Args:
        step: scaled one-step solution, shape (n, n W_1, 6), W_1 = 18 T_ini + 12.
        meta: of the predictor with N steps.

    Returns:
        Shape (n, n W, 6 N), scaled.
    """
    n, T_ini, N, W = meta.robots, meta.T_ini, meta.N, meta.width
    past_u = N_FORCES * T_ini
    blocks = step.reshape(n, n, -1, N_OUTPUTS).transpose(0, 3, 1, 2)  # i, 6, j, W_1
    on_u = np.concatenate([blocks[..., :past_u], blocks[..., meta.past :]], axis=3)
    lagged = blocks[..., past_u : meta.past].reshape(n * N_OUTPUTS, n, T_ini, N_OUTPUTS)
    on_y = lagged.transpose(0, 2, 1, 3).reshape(n * N_OUTPUTS, -1)  # columns: time, robot, 6

    rows = np.arange(n * W).reshape(n, W)
    u_at = np.concatenate([rows[:, :past_u], rows[:, meta.past :]], axis=1)  # samples in a row
    y = np.zeros((T_ini + N, n * N_OUTPUTS, n * W))  # each output as a map of z
    for s in range(T_ini):
        first = past_u + N_OUTPUTS * s
        y[s, np.arange(n * N_OUTPUTS), rows[:, first : first + N_OUTPUTS].ravel()] = 1.0
    for t in range(N):
        new = on_y @ y[t : t + T_ini].reshape(-1, n * W)
        forces = u_at[:, N_FORCES * t : N_FORCES * (t + T_ini + 1)]
        new[:, forces.ravel()] += on_u.reshape(n * N_OUTPUTS, -1)
        y[T_ini + t] = new
    future = y[T_ini:].reshape(N, n, N_OUTPUTS, n * W)
    return future.transpose(1, 3, 0, 2).reshape(n, n * W, -1)
