"""What paired seeds say and how surely: intervals and tests, each a closed form of counts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np

CONFIDENCE: Final = 0.95
Interval = tuple[float, float]


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
        wanted = ((True, True), (True, False), (False, True), (False, False))
        return cls(*(sum(pair == kind for pair in pairs) for kind in wanted))

    @property
    def total(self) -> int:
        """Pairs in all."""
        return self.both + self.first + self.second + self.neither


def wilson(count: int, total: int, confidence: float = CONFIDENCE) -> Interval:
    """Wilson's score interval of a proportion: (0, 1) if nothing was counted.

    Those p with |count/total − p| ≤ z √(p (1 − p) / total); E. B. Wilson, JASA 22 (1927).
    """
    if not total:
        return 0.0, 1.0
    z, share = _z(confidence), count / total
    middle = share + z**2 / (2 * total)
    half = z * math.sqrt(share * (1 - share) / total + (z / (2 * total)) ** 2)
    scale = 1 + z**2 / total
    low, high = (middle - half) / scale, (middle + half) / scale
    return (0.0 if count == 0 else low), (1.0 if count == total else high)


def mcnemar(pairs: Pairs) -> float:
    """Two-sided p of McNemar's exact test that both of a pair are as likely to be the one alone.

    Twice the smaller tail of the binomial distribution of the pairs that differ, at most 1.
    """
    differ, fewer = pairs.first + pairs.second, min(pairs.first, pairs.second)
    ways = sum(math.comb(differ, k) for k in range(fewer + 1))
    return min(1.0, ways / 2 ** (differ - 1)) if differ else 1.0


def paired_difference(pairs: Pairs, confidence: float = CONFIDENCE) -> tuple[float, float, float]:
    """Proportion of the first less that of the second, with the ends of its interval.

    Newcombe's square-and-add interval for paired proportions: method 10 of R. G. Newcombe,
    Statistics in Medicine 17 (1998) 2635–2650. Without any pair it is (0, −1, 1).
    """
    n = pairs.total
    if not n:
        return 0.0, -1.0, 1.0
    one, two = pairs.both + pairs.first, pairs.both + pairs.second
    (low_1, high_1), (low_2, high_2) = wilson(one, n, confidence), wilson(two, n, confidence)
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


def median_interval(values: Sequence[float], confidence: float = CONFIDENCE) -> Interval | None:
    """An interval that holds the median of a population with at least this confidence.

    The k-th least and the k-th greatest value, k as large as the binomial distribution allows:
    exact whatever the distribution, without random numbers. None if there are too few values:
    fewer than 6 cannot give 95 %.
    """
    n, tail, k = len(values), 0.0, 0
    while k <= n // 2:
        tail += math.comb(n, k) / 2**n  # of at most k values below the median
        if 2 * tail > 1 - confidence:
            break
        k += 1
    if k == 0:
        return None
    ordered = sorted(values)
    return float(ordered[k - 1]), float(ordered[n - k])


def _z(confidence: float) -> float:
    return NormalDist().inv_cdf(0.5 + confidence / 2)
