"""From the raw counts of a robot's feet to N: by loads that are known while it stands still.

A robot's foot sensors give counts of a scale and an offset of their own. While the robot stands
and puts its weight on one diagonal of feet and then on the other, each foot's counts c are
regressed on its load f, which the joints' torques and the weight tell: c = c₀ + k f. A robot that
lies is no measure of c₀: with folded legs, too, its feet may bear its weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.robot.conventions import FOOT_FRAMES, N_LEGS, Array

_LEAST_SPREAD: Final = 4.0  # N, standard deviation of a load that shows a scale
_CORRELATED: Final = 0.8  # squared correlation of counts and loads from which on a sensor counts
_LEAST_SCALE: Final = 0.05  # counts per N; with less, a count is more than a contact's least load
_FAR: Final = 5.0  # times the median of what counts are off a line
_FEWEST: Final = 50  # reports


class FootScales(NamedTuple):
    """How counts of the feet become N.

    Attributes:
        unloaded: counts without load, (4,).
        per_newton: counts per N, (4,); 0 of a sensor that shows no load.
    """

    unloaded: Array
    per_newton: Array

    @property
    def dead(self) -> tuple[str, ...]:
        """Names of the feet whose sensors show no load."""
        return tuple(
            foot for foot, scale in zip(FOOT_FRAMES, self.per_newton, strict=True) if not scale
        )


def fit_scales(counts: Sequence[Array], loads: Sequence[Array]) -> FootScales:
    """The scales by counts and loads of the same moments.

    A foot whose counts do not rise with its load, or not by enough, has no scale: a sensor that is
    absent, dead or stuck, or that gives noise alone.

    Args:
        counts: raw, each (4,).
        loads: each (4,), N.
    """
    unloaded, per_newton = np.zeros(N_LEGS), np.zeros(N_LEGS)
    if len(counts) < _FEWEST:
        return FootScales(unloaded, per_newton)
    c, f = np.array(counts, dtype=np.float64), np.array(loads, dtype=np.float64)
    for leg in range(N_LEGS):
        if line := _fit_line(f[:, leg], c[:, leg]):
            unloaded[leg], per_newton[leg] = line
    return FootScales(unloaded, per_newton)


def _fit_line(load: Array, count: Array) -> tuple[float, float] | None:
    """Count at no load, and counts per N; None if the count does not tell the load.

    A sensor may fail for a moment. Then it reads 0, or what is far off the line through the medians
    of much and of little load: both are left out.
    """
    fails = count == 0.0
    load, count = load[~fails], count[~fails]
    if len(load) < _FEWEST or load.std() < _LEAST_SPREAD:
        return None
    more, less = load > np.median(load), load <= np.median(load)
    slope = (np.median(count[more]) - np.median(count[less])) / (
        np.median(load[more]) - np.median(load[less])
    )
    off = count - slope * load
    off = np.abs(off - np.median(off))
    kept = off <= max(_FAR * float(np.median(off)), 1.0)
    load, count = load[kept], count[kept]
    if len(load) < _FEWEST or load.std() < _LEAST_SPREAD:
        return None
    covariance = float(np.mean((load - load.mean()) * (count - count.mean())))
    scale = covariance / float(load.var())
    sure = covariance**2 >= _CORRELATED * float(load.var() * count.var())
    if not (sure and scale >= _LEAST_SCALE):
        return None
    return float(count.mean() - scale * load.mean()), scale


def to_newtons(counts: Array, scales: FootScales) -> Array:
    """Loads of the feet, (4,), N, none negative; 0 of a sensor that shows no load."""
    shows = scales.per_newton > 0.0
    loads: Array = np.divide(
        counts - scales.unloaded, scales.per_newton, out=np.zeros(N_LEGS), where=shows
    )
    return np.maximum(loads, 0.0)
