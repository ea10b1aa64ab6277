"""What paired seeds say and how surely: 95 % intervals, and a test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from scipy.stats import binom, binomtest

CONFIDENCE: Final = 0.95
Bounds = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Pairs:
    """How often something happened to both of a pair, to one of them, to neither.

    Attributes:
        both: to both.
        first: to the first alone.
        second: to the second alone.
        neither: to neither.
    """

    both: int
    first: int
    second: int
    neither: int

    @classmethod
    def of(cls, pairs: Sequence[tuple[bool, bool]]) -> Pairs:
        """Counts of pairs."""
        kinds = ((True, True), (True, False), (False, True), (False, False))
        return cls(*(sum(pair == kind for pair in pairs) for kind in kinds))

    @property
    def total(self) -> int:
        """Pairs in all."""
        return self.both + self.first + self.second + self.neither


@cache
def wilson(count: int, total: int) -> Bounds:
    """Wilson's score interval of a proportion: (0, 1) if nothing was counted."""
    if not total:
        return 0.0, 1.0
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)


def mcnemar(pairs: Pairs) -> float:
    """Two-sided p of McNemar's exact test that both of a pair are as likely to be the one alone."""
    differ = pairs.first + pairs.second
    return float(binomtest(pairs.first, differ).pvalue) if differ else 1.0


def paired_difference(pairs: Pairs) -> tuple[float, float, float]:
    """Proportion of the first less that of the second, with the ends of its interval.

    Newcombe's square-and-add interval for paired proportions: method 10 of R. G. Newcombe,
    Statistics in Medicine 17 (1998) 2635–2650. Without any pair it is (0, −1, 1).
    """
    n = pairs.total
    if not n:
        return 0.0, -1.0, 1.0
    one, two = pairs.both + pairs.first, pairs.both + pairs.second
    (low_1, high_1), (low_2, high_2) = wilson(one, n), wilson(two, n)
    p_1, p_2, phi = one / n, two / n, _phi(pairs)
    difference = (pairs.first - pairs.second) / n

    def reach(a: float, b: float) -> float:
        return math.sqrt(max(0.0, a**2 - 2 * phi * a * b + b**2))

    low = difference - reach(p_1 - low_1, high_2 - p_2)
    high = difference + reach(p_2 - low_2, high_1 - p_1)
    return difference, max(low, -1.0), min(high, 1.0)


def _phi(pairs: Pairs) -> float:
    """Correlation of a pair; a positive one is corrected for continuity, as method 10 has it."""
    n = pairs.total
    one, two = pairs.both + pairs.first, pairs.both + pairs.second
    margins = one * (n - one) * two * (n - two)
    if not margins:
        return 0.0
    excess: float = pairs.both * pairs.neither - pairs.first * pairs.second
    if excess > 0:
        excess = max(excess - n / 2, 0.0)
    return excess / math.sqrt(margins)


def median(values: Sequence[float]) -> float | None:
    """The median, None of nothing."""
    return float(np.median(values)) if len(values) else None


def median_interval(values: Sequence[float]) -> Bounds | None:
    """An interval that holds the median of a population with at least this confidence.

    The k-th least and the k-th greatest value, k as large as the binomial distribution allows:
    exact whatever the distribution, without random numbers. None if there are too few values:
    fewer than 6 cannot give 95 %.
    """
    n = len(values)
    k = int(binom.ppf((1 - CONFIDENCE) / 2, n, 0.5)) if n else 0
    if not k:
        return None
    ordered = sorted(values)
    return float(ordered[k - 1]), float(ordered[n - k])
