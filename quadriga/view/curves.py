"""The last seconds of what is planned, measured, true and asked for, as curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from quadriga.shared.robots.conventions import N_OUTPUTS, Array
from quadriga.view.picture import TeamOutputs

SECONDS: Final = 8.0  # that are shown
_STEP_MS: Final = 50
SAMPLES: Final = round(1000 * SECONDS / _STEP_MS)
KINDS: Final = ("measured", "planned", "true")
_BREAK_MS: Final = 1000  # a longer step, or one back, begins anew


class CurveWindow:
    """A window of samples that moves on with time; NaN where nothing is known.

    Attributes:
        seconds: world time of the samples, shape (SAMPLES,), s; the newest is the last.
        values: by kind and robot, shape (SAMPLES, 3, n, 6).
        asked: shape (SAMPLES, 6).
    """

    def __init__(self, robots: int) -> None:
        """Begin with nothing."""
        self.seconds = np.zeros(SAMPLES)
        self.values = np.zeros((SAMPLES, len(KINDS), robots, N_OUTPUTS))
        self.asked = np.zeros((SAMPLES, N_OUTPUTS))
        self._tick = -_BREAK_MS - 1

    def follows(self, tick: int) -> bool:
        """Whether a sample at a tick would go on from the newest."""
        return 0 <= tick - self._tick <= _BREAK_MS

    def is_due(self, tick: int) -> bool:
        """Whether a sample at a tick would be taken."""
        return not self.follows(tick) or tick - self._tick >= _STEP_MS

    def add(self, tick: int, outputs: TeamOutputs) -> None:
        """Add a sample if the newest is old enough; one that does not follow begins anew."""
        if not self.is_due(tick):
            return
        if self.follows(tick):
            for array in (self.seconds, self.values, self.asked):
                array[:-1] = array[1:]
        else:
            self.values[:], self.asked[:] = np.nan, np.nan
            self.seconds[:] = 1e-3 * (tick + _STEP_MS * np.arange(-SAMPLES + 1, 1))
        self.seconds[-1] = 1e-3 * tick
        self.values[-1] = outputs.measured, outputs.planned, outputs.true
        self.asked[-1] = outputs.asked
        self._tick = tick

    def of_all(self, output: int) -> tuple[Array, ...]:
        """Time, what each robot measures of an output, and what is asked for; each (SAMPLES,)."""
        return self.seconds, *self.values[:, 0, :, output].T, self.asked[:, output]

    def of_robot(self, robot: int, output: int) -> tuple[Array, ...]:
        """Time, `KINDS` of one robot's output, and what is asked for; each of shape (SAMPLES,)."""
        return self.seconds, *self.values[:, :, robot, output].T, self.asked[:, output]


def axis_range(curves: Sequence[Array], step: float) -> tuple[float, float]:
    """What an axis must show of some curves: multiples of `step`, so that it seldom changes.

    NaN counts for nothing; of nothing else it is from 0 to `step`.
    """
    values = np.concatenate([np.ravel(curve) for curve in curves])
    values = values[np.isfinite(values)]
    low = step * float(np.floor(values.min(initial=np.inf) / step)) if len(values) else 0.0
    high = step * float(np.ceil(values.max(initial=-np.inf) / step)) if len(values) else step
    return low, max(high, low + step)


def ticks_before(tick: int) -> range:
    """Ticks whose samples fill a window that ends at `tick`, in ascending order."""
    return range(tick - round(1000 * SECONDS), tick + 1, _STEP_MS)
