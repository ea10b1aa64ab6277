"""Quantiles out of bins against numpy's."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.runtime.histogram import Histogram


@given(st.lists(st.floats(0.0, 50.0), min_size=1, max_size=300))
def test_quantiles_are_exact_to_a_bin(values: list[float]) -> None:
    histogram = Histogram(0.1)
    for value in values:
        histogram.add(value)
    quantiles = histogram.quantiles("age")
    for name, q in (("median", 0.5), ("p99", 0.99)):
        exact = float(np.quantile(values, q, method="inverted_cdf"))
        assert exact - 0.1 - 1e-9 <= quantiles[f"age.{name}"] <= exact + 1e-9
    assert quantiles["age.max"] == max(values)


def test_nothing_is_told_of_nothing() -> None:
    assert Histogram(1.0).quantiles("age") == {}
