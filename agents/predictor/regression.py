"""Normal equations of the regression that every fit of G solves, from sliding Gram matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.hankel import columns, gram
from quadriga.agents.predictor.layout import Layout, scales
from quadriga.shared.robot.conventions import Array

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Regression:
    """Sums over M windows of scaled signals, z = [z^1; …; z^n], z^j = [u_ini^j; y_ini^j; u^j].

    Attributes:
        zz: Σ z zᵀ, shape (n W, n W).
        zy: Σ z y^iᵀ for every agent i, shape (n W, n, p N).
        windows: M.
    """

    zz: Array
    zy: Array
    windows: int


def normal_equations(signals: Sequence[Array], layout: Layout) -> Regression:
    """The regression over all windows of all episodes.

    Args:
        signals: of each episode, scaled: [u of all agents; y of all agents], shape (T, n (m + p)).
        layout: of the predictor.
    """
    L = layout.T_ini + layout.N
    return _split_by_agent(gram(signals, L), layout, columns(signals, L))


def to_physical(x: Array, layout: Layout) -> Array:
    """Blocks in physical units, (n, n, p N, W), from scaled solutions (n, n W, p N)."""
    n = layout.agents
    blocks = x.reshape(n, n, layout.width, -1).transpose(0, 1, 3, 2)
    z_scale, y_scale = scales(layout)
    return np.ascontiguousarray(blocks * y_scale[:, None] / z_scale)


def scaled_blocks(G: Array, layout: Layout) -> Array:
    """Blocks that map scaled signals to scaled signals, of the shape of `G`."""
    z_scale, y_scale = scales(layout)
    return G * z_scale / y_scale[:, None]


def past_first(layout: Layout, members: Sequence[int]) -> Index:
    """Rows of `zz` of some agents by time: all [u_ini; y_ini], then each sample's inputs."""
    rows = np.arange(layout.agents * layout.width).reshape(layout.agents, -1)[list(members)]
    future = rows[:, layout.past :].reshape(len(members), layout.N, layout.inputs)
    return np.concatenate([rows[:, : layout.past].ravel(), future.transpose(1, 0, 2).ravel()])


def agents_first(index: Index, n: int, dim: int) -> Index:
    """Reorder stacked (time, agent, dim) indices to one row of (time, dim) per agent."""
    return index.reshape(-1, n, dim).transpose(1, 0, 2).reshape(n, -1)


def _split_by_agent(S: Array, layout: Layout, windows: int) -> Regression:
    """Cut the Gram matrix of windows of [u of all; y of all] into the agents' parts."""
    n, m, p = layout.agents, layout.inputs, layout.outputs
    index = np.arange((layout.T_ini + layout.N) * n * (m + p)).reshape(-1, n * (m + p))
    past, future = index[: layout.T_ini], index[layout.T_ini :]
    parts = ((past[:, : n * m], m), (past[:, n * m :], p), (future[:, : n * m], m))
    inputs = np.concatenate([agents_first(part, n, dim) for part, dim in parts], axis=1).ravel()
    outputs = agents_first(future[:, n * m :], n, p).ravel()
    return Regression(
        S[np.ix_(inputs, inputs)], S[np.ix_(inputs, outputs)].reshape(len(inputs), n, -1), windows
    )
