"""A histogram of values over a walk: counts in bins of fixed width, and quantiles of them."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from itertools import accumulate
from typing import Final

QUANTILES: Final = {"median": 0.5, "p99": 0.99}


class Histogram:
    """Counts values ≥ 0; its quantiles are exact to a bin's width, which has their unit."""

    def __init__(self, width: float) -> None:
        self._width, self._max = width, 0.0
        self._bins: Counter[int] = Counter()

    def add(self, value: float) -> None:
        """Count one value."""
        self._bins[int(value / self._width)] += 1
        self._max = max(self._max, value)

    def quantiles(self, name: str) -> dict[str, float]:
        """`<name>.median`, `<name>.p99` (lower edges of their bins) and `<name>.max`.

        Nothing if nothing has been counted.
        """
        if not self._bins:
            return {}
        places = sorted(self._bins)
        seen = list(accumulate(self._bins[place] for place in places))
        found = {key: places[bisect_left(seen, q * seen[-1])] for key, q in QUANTILES.items()}
        quantiles = {f"{name}.{key}": place * self._width for key, place in found.items()}
        return {**quantiles, f"{name}.max": self._max}
