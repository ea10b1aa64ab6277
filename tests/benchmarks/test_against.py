"""Figures of two states of the code, and what is made of them."""

from __future__ import annotations

import subprocess
import sys

from benchmarks.against import FigureInTurns, compare, list_figures, table


def test_figures_are_those_that_are_measured() -> None:
    result = {
        "machine": {"cores": 2},
        "quick": False,
        "low_level_us_median": 150.0,
        "low_level_vs_tsid": None,
        "recorder_gaps": 0,
        "rtf": {"1": 0.9, "3": 0.5},
        "parts": {"walks": {"seconds": 4.0}},
        "seconds": 200.0,
    }
    assert list_figures(result) == {"low_level_us_median": 150.0, "rtf.1": 0.9, "rtf.3": 0.5}


def test_what_counts_is_the_ratio_within_a_pair() -> None:
    pairs = [({"a": 1.0, "old": 3.0}, {"a": 2.0}), ({"a": 4.0}, {"a": 2.0, "new": 1.0})]
    (only,) = compare(pairs)
    assert only == FigureInTurns("a", (1.0, 4.0), (2.0, 2.0))
    assert only.ratios == [2.0, 0.5]
    assert table("abc", [only]).rows == (("a", "2.5", "2", "1.000", "0.500 … 2.000"),)


def test_a_commit_that_there_is_not_is_one_line() -> None:
    command = [sys.executable, "-m", "benchmarks.against", "no-such-commit"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("benchmarks.against: COMMIT: got 'no-such-commit'")
    assert done.stderr.count("\n") == 1
