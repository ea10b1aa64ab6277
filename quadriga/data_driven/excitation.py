"""Hankel matrices (eq. 2) and whether inputs excite a plant (definition 1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.excitation import excitation
from quadriga.agents.predictor.hankel import columns, mosaic
from quadriga.data_driven.signals import as_numbers, root_mean_squares
from quadriga.data_driven.trajectories import Data
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


def hankel(signal: ArrayLike | Sequence[ArrayLike], L: int) -> Array:
    """The block Hankel matrix of eq. 2: column c stacks samples c … c + L − 1.

    Args:
        signal: shape (T, dim), or a list of episodes, whose matrices then stand side by side; no
            column straddles two of them, and those shorter than L have none.
        L: number of block rows.

    Returns:
        Shape (dim L, T − L + 1).

    Raises:
        PredictorError: another shape, NaN, or fewer samples than block rows.
    """
    return mosaic([x for x in _signals(signal, L) if len(x) >= L], L)


def is_persistently_exciting(signal: ArrayLike | Sequence[ArrayLike], order: int) -> bool:
    """Whether the Hankel matrix of `order` of a signal has full row rank (definition 1).

    For the fundamental lemma (Willems et al.) the inputs must be so of the order past + horizon +
    states of the plant. Singular values below 1e-6 of the largest count as zero.

    Args:
        signal: shape (T, dim), or a list of episodes, which count together.
        order: number of block rows.

    Raises:
        PredictorError: another shape, NaN, or fewer samples than block rows.
    """
    return excitation(_signals(signal, order), order).persistent


def check_excitation(data: Data, order: int) -> None:
    """Refuse inputs from which a plant's response cannot be told.

    Raises:
        PredictorError: the inputs are not persistently exciting of this order.
    """
    sizes = np.array(root_mean_squares(data.u))
    found = excitation([(u / sizes).reshape(len(u), -1) for u in data.u], order)
    if not found.persistent:
        raise PredictorError(
            "data.u",
            f"inputs that are not persistently exciting of order {order}, past and horizon "
            f"(rank {found.rank} of {found.rows}, {found.columns} columns)",
            f"a Hankel matrix of rank {found.rows}",
            "too little data, or an input that hardly varies",
        )


def _signals(signal: ArrayLike | Sequence[ArrayLike], L: int) -> list[Array]:
    given: list[Any] = [signal]
    if isinstance(signal, list | tuple) and signal and np.ndim(signal[0]) == 2:
        given = [*signal]
    signals = [as_numbers("signal", one) for one in given]
    if any(x.ndim != 2 or x.shape[1] != signals[0].shape[1] for x in signals):
        shapes = [x.shape for x in signals]
        raise PredictorError("signal", f"shapes {shapes}", "(T, dim), alike in all episodes")
    if L < 1 or not columns(signals, L):
        raise PredictorError(
            "signal",
            f"at most {max(len(x) for x in signals)} samples in a row",
            f"at least {L}, the number of block rows, which is positive",
            "too little data",
        )
    return signals
