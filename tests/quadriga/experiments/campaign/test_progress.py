"""What is said while trials are walked where there is no terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from quadriga.experiments.campaign import progress
from quadriga.experiments.campaign.progress import TrialProgress, format_duration
from tests.manual_clock import ManualClock
from tests.quadriga.experiments.rows import row


def test_a_line_now_and_then_says_how_long_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, output = ManualClock(), io.StringIO()
    monkeypatch.setattr(progress, "monotonic", clock.monotonic)
    with TrialProgress(Console(file=output, width=100), 10, 2) as shown:
        for seed in range(4):
            clock.sleep(50.0)
            shown.advance(row("none", seed, fell=1.0 if seed == 0 else None))
    assert output.getvalue().splitlines() == [
        "2 of 10 trials are walked already",
        "4/10 trials, 1 fell, 5 min left",
        "6/10 trials, 1 fell, 3 min left",
        "4 trials in 3 min, 1 of them with a fall",
    ]


def test_durations_are_for_people() -> None:
    assert [format_duration(s) for s in (0.4, 89.0, 100.0, 5300.0, 11_100.0)] == [
        "0 s",
        "89 s",
        "2 min",
        "88 min",
        "3 h 05 min",
    ]
