"""A histogram of values over a walk: counts in bins of fixed width, and quantiles of them."""

from __future__ import annotations

from collections import Counter
from typing import Final

QUANTILES: Final = {"median": 0.5, "p99": 0.99}


class Histogram:
    """Counts values ≥ 0; its quantiles are exact to a bin's width.

    Args:
        width: of a bin, in the values' unit.
    """

    def __init__(self, width: float) -> None:
        self._width = width
        self._bins: Counter[int] = Counter()
        self._count = 0
        self._max = 0.0

    def add(self, value: float) -> None:
        """Count one value."""
        self._bins[int(value / self._width)] += 1
        self._count += 1
        if value > self._max:
            self._max = value

    def quantiles(self, name: str) -> dict[str, float]:
        """`<name>.median`, `<name>.p99` (lower edges of their bins) and `<name>.max`.

        Nothing if nothing has been counted.
        """
        if not self._count:
            return {}
        quantiles: dict[str, float] = {}
        seen, bins = 0, sorted(self._bins)
        left = dict(QUANTILES)
        for place in bins:
            seen += self._bins[place]
            for key in [key for key, share in left.items() if seen >= share * self._count]:
                del left[key]
                quantiles[f"{name}.{key}"] = place * self._width
        return {**quantiles, f"{name}.max": self._max}
