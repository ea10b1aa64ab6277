"""Whether inputs excite a plant enough to identify it (definition 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from quadriga.agents.predictor.hankel import columns, gram
from quadriga.shared.robot.conventions import Array

# Singular values below 1e-6 of the largest count as zero (Gram eigenvalues are their squares).
_RANK_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True)
class Excitation:
    """Result of the rank test: persistently exciting of `order` if `rank` equals `rows`."""

    order: int
    rows: int
    columns: int
    rank: int

    @property
    def persistent(self) -> bool:
        """Whether the Hankel matrix has full row rank (definition 1)."""
        return self.rank == self.rows


def excitation(inputs: Sequence[Array], order: int) -> Excitation:
    """Rank of the Hankel matrix of `order` of the inputs of all episodes together.

    Args:
        inputs: per episode shape (T, m).
        order: L + n, horizon plus system order.
    """
    rows, count = order * inputs[0].shape[1], columns(inputs, order)
    S = gram(inputs, order)
    floor = _RANK_TOLERANCE * max(float(np.linalg.norm(S)), np.finfo(float).tiny)
    S.flat[:: rows + 1] -= floor
    try:  # Cholesky shows 20 times faster that no eigenvalue is small
        linalg.cholesky(S.T, lower=True, overwrite_a=True, check_finite=False)
        rank = rows
    except linalg.LinAlgError:
        eigenvalues = linalg.eigvalsh(gram(inputs, order), overwrite_a=True, check_finite=False)
        rank = int((eigenvalues > floor).sum())
    return Excitation(order, rows, count, rank)
