"""What is made of the figures that benchmarks measure, and what is held to a limit."""

from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from benchmarks.against import FigureInTurns, compare, table
from benchmarks.endurance import grown
from benchmarks.page import TARGETS, headline, targets


def lines_of(figures: dict[str, Any]) -> dict[str, str]:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(targets(figures))
    return {line.split()[0]: line for line in capture.get().splitlines()}


def test_each_limit_is_met_missed_or_not_measured() -> None:
    figures = headline({}) | {"rtf": {"3": 1.4, "5": 0.9}, "recorder_gaps": 2}
    found = lines_of(figures)
    assert set(found) == {key for key, _, _ in TARGETS}
    assert "held to >= 1.5: MISSED" in found["rtf.3"]
    assert "held to >= 0.8: met" in found["rtf.5"]
    assert "held to >= 0.5: not measured" in found["rtf.10"]
    assert "held to <= 0: MISSED" in found["recorder_gaps"]
    assert "not measured" in found["planner_constrained_ratio_p99"]


def test_what_counts_is_the_ratio_within_a_pair() -> None:
    pairs = [({"a": 1.0, "old": 3.0}, {"a": 2.0}), ({"a": 4.0}, {"a": 2.0, "new": 1.0})]
    (only,) = compare(pairs)
    assert only == FigureInTurns("a", (1.0, 4.0), (2.0, 2.0))
    assert only.ratios == [2.0, 0.5]
    assert table("abc", [only]).rows == (("a", "2.5", "2", "1.000", "0.500 … 2.000"),)


def samples(*values: float) -> list[tuple[float, float]]:
    return [(10.0 * k, value) for k, value in enumerate(values)]


def test_growth_is_of_the_time_after_a_walk_has_settled() -> None:
    start_up = [50.0] * 10 + [200.0] * 90
    assert grown(samples(*start_up)) == 0.0
    leaking = [100.0 + k for k in range(100)]
    assert grown(samples(*leaking)) == pytest.approx(195.0 / 115.0 - 1.0)
    shrinking = [100.0] * 50 + [90.0] * 50
    assert grown(samples(*shrinking)) == pytest.approx(-0.1)
    assert grown(samples(100.0)) == 0.0, "one sample has not grown"
