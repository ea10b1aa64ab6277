"""The benchmark's page: what is held to a limit, and that nothing that misses it is hidden."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.page import TARGETS, headline, targets
from benchmarks.planner_contenders import is_at_bound
from benchmarks.realtime import late_commands
from quadriga.shared.config.load import load


def lines_of(figures: dict[str, Any]) -> dict[str, str]:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(targets(figures))
    return {line.split()[0]: line for line in capture.get().splitlines()}


def test_each_limit_is_met_missed_or_not_measured() -> None:
    figures = headline({}) | {"rtf": {"3": 1.4, "5": 0.9}, "realtime_late_share": 0.2}
    found = lines_of(figures)
    assert set(found) == {key for key, _, _ in TARGETS}
    assert "held to >= 1.5: MISSED" in found["rtf.3"]
    assert "held to >= 0.8: met" in found["rtf.5"]
    assert "held to >= 0.5: not measured" in found["rtf.10"]
    assert "held to <= 0.03: MISSED" in found["realtime_late_share"]
    assert "not measured" in found["planner_constrained_ratio_p99"]


def test_the_worst_robot_tells_how_late_commands_were() -> None:
    good = {"late_share": 0.01, "command_age_ms": {"max": 3.0}}
    bad = {"late_share": None, "command_age_ms": {"max": 5.0}}
    summary = {
        "realtime": {"r1": good, "r2": bad},
        "real_time_factor": 1.0,
        "gaps": 0,
        "fallen": [],
        "end": "done",
    }
    walk = late_commands(summary, load(None, {"team.robots": 2}))
    assert (walk["late_share"], walk["oldest_ms"]) == (1.0, 5.0)


def test_a_plan_is_at_a_bound_where_one_holds_it() -> None:
    limits = {"A": np.array([[1.0, 1.0]]), "upper": np.ones(3), "lower": np.full(3, -np.inf)}
    problem: Any = SimpleNamespace(**limits)
    assert is_at_bound(problem, np.array([0.5, 0.5]))
    assert not is_at_bound(problem, np.array([0.5, 0.4]))
