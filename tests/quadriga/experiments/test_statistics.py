"""Intervals and tests against published values, closed forms, scipy, and what must always hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from quadriga.experiments.statistics import (
    Pairs,
    mcnemar,
    median,
    median_interval,
    paired_difference,
    wilson,
)

COUNTS = st.integers(0, 300)
PAIRS = st.builds(Pairs, COUNTS, COUNTS, COUNTS, COUNTS)


def test_wilson_is_as_published() -> None:
    """R. G. Newcombe, Statistics in Medicine 17 (1998) 857–872, table I, method 3."""
    for count, total, expected in (
        (81, 263, (0.2553, 0.3662)),
        (15, 148, (0.0624, 0.1605)),
        (0, 20, (0.0, 0.1611)),
        (1, 29, (0.0061, 0.1718)),
    ):
        assert wilson(count, total) == pytest.approx(expected, abs=5e-5)
    assert wilson(20, 20) == pytest.approx((1 - 0.1611, 1.0), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)


@settings(deadline=None)  # a busy machine is not the subject
@given(st.integers(1, 500), st.data())
def test_wilson_solves_its_equation(total: int, data: st.DataObject) -> None:
    """At both ends the count lies z standard deviations of that end from it; as scipy has it."""
    count = data.draw(st.integers(0, total))
    low, high = wilson(count, total)
    assert 0.0 <= low <= count / total <= high <= 1.0
    for end in (low, high):
        if 0.0 < end < 1.0:
            z = (count / total - end) / math.sqrt(end * (1 - end) / total)
            assert abs(z) == pytest.approx(1.959964, rel=1e-4)
    known = stats.binomtest(count, total).proportion_ci(0.95, "wilson")
    assert (low, high) == pytest.approx((known.low, known.high), abs=1e-9)


def test_mcnemar_is_the_binomial_test_of_the_pairs_that_differ() -> None:
    assert mcnemar(Pairs(5, 0, 0, 9)) == 1.0
    assert mcnemar(Pairs(0, 6, 0, 0)) == 2 / 2**6
    assert mcnemar(Pairs(0, 1, 7, 12)) == pytest.approx(0.0703125)  # 2 (1 + 8) / 256
    assert mcnemar(Pairs(3, 4, 4, 3)) == 1.0


@settings(deadline=None)  # a busy machine is not the subject
@given(PAIRS)
def test_mcnemar_is_what_scipy_says(pairs: Pairs) -> None:
    differ = pairs.first + pairs.second
    known = stats.binomtest(pairs.first, differ).pvalue if differ else 1.0
    assert mcnemar(pairs) == pytest.approx(known, rel=1e-9)
    swapped = Pairs(pairs.both, pairs.second, pairs.first, pairs.neither)
    assert mcnemar(swapped) == mcnemar(pairs)


def test_the_paired_difference_is_as_published() -> None:
    """Fagerland et al., Statistics in Medicine 33 (2014), and table 6.2 of Altman et al. (2000)."""
    found = paired_difference(Pairs(1, 1, 7, 12))
    assert found == pytest.approx((-6 / 21, -0.507, -0.026), abs=5e-4)
    found = paired_difference(Pairs(14, 5, 0, 22))
    assert found == pytest.approx((5 / 41, 0.011, 0.226), abs=5e-4)
    assert paired_difference(Pairs(0, 0, 0, 0)) == (0.0, -1.0, 1.0)


def test_independent_pairs_add_the_squares_of_their_intervals() -> None:
    """Without correlation the interval is Newcombe's for two independent proportions."""
    difference, low, high = paired_difference(Pairs(8, 8, 2, 2))
    (a, b), (c, d) = wilson(16, 20), wilson(10, 20)
    assert difference == pytest.approx(0.3)
    assert low == pytest.approx(0.3 - math.hypot(0.8 - a, d - 0.5))
    assert high == pytest.approx(0.3 + math.hypot(b - 0.8, 0.5 - c))


@settings(deadline=None)  # a busy machine is not the subject
@given(PAIRS)
def test_the_paired_difference_is_in_its_interval_and_turns_with_the_pairs(pairs: Pairs) -> None:
    difference, low, high = paired_difference(pairs)
    assert -1.0 <= low <= difference + 1e-12
    assert difference - 1e-12 <= high <= 1.0
    turned = paired_difference(Pairs(pairs.both, pairs.second, pairs.first, pairs.neither))
    assert turned == pytest.approx((-difference, -high, -low), abs=1e-12)
    missed = paired_difference(Pairs(pairs.neither, pairs.first, pairs.second, pairs.both))
    assert missed == pytest.approx((difference, low, high), abs=1e-12)


def test_the_paired_difference_covers_what_it_should() -> None:
    """Falls of 10 % and 20 %, correlated, 100 pairs: 95 % of the intervals hold the difference."""
    random = np.random.default_rng(1)
    draws = random.multinomial(100, (0.06, 0.04, 0.14, 0.76), size=4000)
    intervals = [paired_difference(Pairs(*map(int, draw)))[1:] for draw in draws]
    held = np.mean([low <= -0.1 <= high for low, high in intervals])
    assert held == pytest.approx(0.95, abs=0.015)


def test_the_median_interval_is_the_tables_order_statistics() -> None:
    """The ranks of every table of the sign test: 6 → 1, 6; 10 → 2, 9; 20 → 6, 15; 50 → 18, 33."""
    for n, ends in ((6, (1, 6)), (10, (2, 9)), (20, (6, 15)), (50, (18, 33))):
        assert median_interval(range(1, n + 1)) == ends
    assert median_interval(range(5)) is None
    assert median_interval([]) is None
    assert median([]) is None


@settings(deadline=None)  # a busy machine is not the subject
@given(st.lists(st.floats(0.01, 100.0), min_size=6, max_size=80))
def test_the_median_lies_in_its_interval(values: list[float]) -> None:
    found, middle = median_interval(values), median(values)
    assert found is not None
    assert middle is not None
    assert found[0] <= middle <= found[1]
    assert median_interval(values[::-1]) == found
    scaled = median_interval([2 * value for value in values])
    assert scaled == (2 * found[0], 2 * found[1])
