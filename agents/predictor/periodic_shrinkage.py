"""Which responses of peers are real, and how far each is drawn towards zero.

Every fold of the data gives an estimate of its own (by the jackknife). Products of the estimates
of two different folds have the square of the true response as their mean, so they tell a response
from noise without knowing the noise; how far the folds scatter tells how much of a response's
square is noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array

_SIGNIFICANT: Final = 3.0  # standard errors
_SMALLEST: Final = 0.08  # of the own response: a smaller one of a peer is left out


@dataclass(frozen=True, slots=True)
class Tested:
    """Responses after test and shrinkage.

    Attributes:
        response: of the shape of the estimate.
        kept: whether robot i's output responds to robot j at all, (n responding, n pushing, 6).
    """

    response: Array
    kept: NDArray[np.bool_]


def shrink(estimate: Array, without: Array) -> Tested:
    """Draw groups of a response towards zero by what of them is noise.

    A group is one polynomial of the phase, at all lags, of one output's response to one component
    of one robot's wrench. With v the variance of its estimate x̂, it is multiplied by
    max(0, 1 − v/|x̂|²) (James and Stein). A peer's effect on an output as a whole is left out if it
    is not significant, or small against the robot's own.

    Args:
        estimate: from all data, (k, N, n pushing, 6, n responding, 6).
        without: from all folds but one, (F, k, N, n, 6, n, 6).
    """
    F = len(without)
    deviation = without - without.mean(axis=0)
    variance = (F - 1) / F * (deviation**2).sum(axis=0)
    square, noise = (x.sum(axis=1, keepdims=True) for x in (estimate**2, variance))
    tiny = np.finfo(float).tiny
    factor = np.clip(1.0 - noise / np.maximum(square, tiny), 0.0, 1.0)
    response = estimate * factor
    weight = 1.0 / np.sqrt(np.maximum(noise, tiny))
    kept = _is_significant((F * estimate - (F - 1) * without) * weight)
    size = np.einsum("kljwio,kljwio->jio", response, response)
    own = np.einsum("iio->io", size)
    kept &= size.transpose(1, 0, 2) > _SMALLEST**2 * own[:, None]
    kept[np.arange(len(kept)), np.arange(len(kept))] = True
    return Tested(response * kept.transpose(1, 0, 2)[None, None, :, None], kept)


def _is_significant(folds: Array) -> NDArray[np.bool_]:
    """Whether an effect is real, from each fold's own estimate over its error. (n, n, 6)."""
    F, n = len(folds), folds.shape[3]
    flat = np.moveaxis(folds, (3, 5, 6), (1, 2, 3)).reshape(F, n, n, folds.shape[-1], -1)
    first, second = np.triu_indices(F, 1)
    pairs = (flat[first] * flat[second]).sum(axis=-1)  # (pairs, pushing, responding, output)
    error = np.sqrt((pairs**2).mean(axis=0) / len(pairs))
    significant: NDArray[np.bool_] = pairs.mean(axis=0) > _SIGNIFICANT * error
    return significant.transpose(1, 0, 2)
