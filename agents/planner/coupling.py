"""The peers' share of eq. 11, Σ G_ij [u_ini; y_ini; u], without columns that are always zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.planner_qp import stance_columns
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled


class Coupling:
    """Effect of the peers on one agent's outputs over a horizon with a given stance schedule.

    A swinging leg of a peer carries no force: its columns, a third of all, are left out, which is
    exact. Single precision changes an effect by 3e-7 of its size and halves the memory that is
    read.

    Args:
        G: the block G_ij of each peer, (6 N, 18 T_ini + 12 N), or one with any other rows.
        stance: of each peer over its plan, (N, 4).
    """

    def __init__(self, G: Sequence[Array] | Array, stance: Sequence[NDArray[np.bool_]]) -> None:
        width = G[0].shape[1] if len(G) else 0
        force_columns = [
            np.concatenate(
                [np.arange(width - 3 * legs.size), width - 3 * legs.size + stance_columns(legs)]
            )
            for legs in stance
        ]
        places = [i * width + columns for i, columns in enumerate(force_columns)]
        self._places = np.concatenate(places) if places else np.zeros(0, dtype=np.int64)
        blocks = [block[:, columns] for block, columns in zip(G, force_columns, strict=True)]
        rows = np.concatenate(blocks, axis=1) if blocks else np.zeros((0, 0))
        self._rows = np.ascontiguousarray(rows, dtype=np.float32)

    def effect(self, z: NDArray[np.float32]) -> Array:
        """The sum for all peers' deviations [u_ini; y_ini; u], (n − 1)(18 T_ini + 12 N).

        Shape (6 N,), or as many as the blocks have rows.
        """
        return (self._rows @ z[self._places]).astype(np.float64)


@compiled
def fill_deviations(
    out: NDArray[np.float32],
    du_ini: Array,
    y_ini: Array,
    y_base: Array,
    known: NDArray[np.bool_],
    du: Array,
) -> None:
    """Write a peer's deviations [u_ini; y_ini; u] into `out`; those of unknown samples are zero.

    `out` is (18 T_ini + 12 N,); the rest is of `PeerData`, where forces are deviations already, and
    the base of the outputs, (T_ini, 6).
    """
    T_ini, at = len(du_ini), 0
    for k in range(T_ini):
        for i in range(N_FORCES):
            out[at] = du_ini[k, i]
            at += 1
    for k in range(T_ini):
        for i in range(N_OUTPUTS):
            out[at] = y_ini[k, i] - y_base[k, i] if known[k] else 0.0
            at += 1
    for k in range(len(du)):
        for i in range(N_FORCES):
            out[at] = du[k, i]
            at += 1
