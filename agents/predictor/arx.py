"""A one-step model of the coupled plant (ARX) rolled out over the horizon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from quadriga.agents.predictor.layout import Layout
from quadriga.agents.predictor.regression import normal_equations
from quadriga.agents.predictor.ridge import Penalty, Solutions, solve_ridge
from quadriga.shared.robot.conventions import Array


def solve_arx(signals: Sequence[Array], layout: Layout, penalty: Penalty) -> Solutions:
    """Solutions over N steps from a ridge regression over one.

    With some peers only as members, the effect of a peer's peer within the horizon is left out:
    G_ij is zero wherever j is no member of i's.

    Args:
        signals: of `normal_equations`.
        layout: of the predictor with N steps.
        penalty: of the one-step regression.

    Raises:
        PredictorError: a singular problem.
    """
    one_step = replace(layout, N=1)
    solutions = solve_ridge(normal_equations(signals, one_step), one_step, penalty)
    x = roll_out(solutions.x, layout)
    for i in range(layout.agents):
        x[i].reshape(layout.agents, layout.width, -1)[layout.strangers(i)] = 0.0
    return Solutions(x, solutions.condition)


def roll_out(step: Array, layout: Layout) -> Array:
    """The N-step response from the one-step model of all agents.

    y_t = Σ_s (A_s y_{t−s} + B_s u_{t−s}) + B_0 u_t, s = 1 … T_ini, each y_{t−s} of the future
    replaced by its own prediction. With data from a feedback loop this is less biased than a fit
    over N steps: no future input that has answered to an output explains that output.

    Args:
        step: scaled one-step solution, shape (n, n W_1, p), W_1 = (m + p) T_ini + m.
        layout: of the predictor with N steps.

    Returns:
        Shape (n, n W, p N), scaled.
    """
    n, T_ini, N, W = layout.agents, layout.T_ini, layout.N, layout.width
    m, p = layout.inputs, layout.outputs
    past_u = m * T_ini
    blocks = step.reshape(n, n, -1, p).transpose(0, 3, 1, 2)  # i, p, j, W_1
    on_u = np.concatenate([blocks[..., :past_u], blocks[..., layout.past :]], axis=3)
    lagged = blocks[..., past_u : layout.past].reshape(n * p, n, T_ini, p)
    on_y = lagged.transpose(0, 2, 1, 3).reshape(n * p, -1)  # columns: time, agent, p

    rows = np.arange(n * W).reshape(n, W)
    u_at = np.concatenate([rows[:, :past_u], rows[:, layout.past :]], axis=1)  # samples in a row
    y = np.zeros((T_ini + N, n * p, n * W))  # each output as a map of z
    for s in range(T_ini):
        first = past_u + p * s
        y[s, np.arange(n * p), rows[:, first : first + p].ravel()] = 1.0
    for t in range(N):
        new = on_y @ y[t : t + T_ini].reshape(-1, n * W)
        inputs = u_at[:, m * t : m * (t + T_ini + 1)]
        new[:, inputs.ravel()] += on_u.reshape(n * p, -1)
        y[T_ini + t] = new
    future = y[T_ini:].reshape(N, n, p, n * W)
    return future.transpose(1, 3, 0, 2).reshape(n, n * W, -1)
