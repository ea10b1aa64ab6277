"""Figures of a trial whose motion is known in closed form, against hand computation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadriga.experiments.trial.figures_of_merit import Walk, compute_figures
from quadriga.experiments.trial.over_bus import read_walk
from quadriga.recordings.summary import steady_from, summary_of
from quadriga.recordings.traces import ERRORS, Traces
from quadriga.shared.messages import Event
from tests.quadriga.conftest import ESTIMATOR_ERROR, SPEED


@pytest.fixture(scope="module")
def walk(known_run: Path) -> Walk:
    return read_walk(known_run / "run.mcap")


def test_tracking_errors_are_those_of_the_summary(walk: Walk) -> None:
    found, summary = compute_figures(walk), summary_of(walk.traces)
    for name in ERRORS:
        assert found.rmse[name] == pytest.approx(summary["rmse"][name], rel=1e-12)
    for name in ("vx", "vy", "wz"):
        assert found.mean[name] == pytest.approx(summary[f"mean_{name}"])
    assert found.planner_ms_median == summary["planner_ms_median"]
    assert found.planner_ms_p99 == summary["planner_ms_p99"]
    assert found.solves == summary["planner_solves"]
    assert not found.fallen
    assert not found.stopped


def test_the_height_over_the_stance_feet_is_what_the_robots_measure(walk: Walk) -> None:
    """A sine of whole periods and the estimator's error, over the steady part of all robots."""
    expected = (0.004**2 / 2 + ESTIMATOR_ERROR[0] ** 2) ** 0.5
    assert compute_figures(walk).rmse["z-over-stance-feet"] == pytest.approx(expected, rel=0.01)
    found = dict(walk.traces.measurements)
    begun, off = steady_from(walk.traces), 0.01
    for name, trace in found.items():
        y = trace.y.copy()
        y[trace.tick < begun, 0] = 1.0  # before it, nothing counts
        y[trace.tick >= begun, 0] = walk.traces.config.reference.height + off
        found[name] = replace(trace, y=y)
        off = 0.0  # of all but the first
    n = walk.traces.config.team.robots
    moved = compute_figures(replace(walk, traces=replace(walk.traces, measurements=found)))
    assert moved.rmse["z-over-stance-feet"] == pytest.approx(0.01 / n**0.5, rel=1e-6)


def test_the_cost_is_the_weighted_mean_of_the_known_errors(walk: Walk) -> None:
    """Sines of whole periods have half their square as mean square."""
    config = walk.traces.config
    n, Q = config.team.robots, config.planner.Q
    pitch = float(np.mean([(0.01 * i) ** 2 for i in range(n)]))
    squares: list[float] = [
        0.004**2 / 2 + ESTIMATOR_ERROR[0] ** 2,  # by the robot's own word
        (SPEED - config.reference.vx) ** 2,
        0.02**2,
        0.03**2 / 2,
        pitch,
        0.0,
    ]
    found = compute_figures(walk)
    expected = sum(q * square for q, square in zip(Q, squares, strict=True))
    assert found.cost_outputs == pytest.approx(expected, rel=0.01)
    assert found.cost_forces == pytest.approx(0.0, abs=1e-9)  # nominal forces were applied
    assert found.cost == pytest.approx(expected, rel=0.01)
    assert found.mean["z"] == pytest.approx(0.26, abs=1e-4)


def test_forces_cost_what_they_deviate(walk: Walk) -> None:
    """One newton more along x and two along z on every foot of one robot."""
    name, *_ = walk.samples
    more = np.tile([1.0, 0.0, 2.0], 4)
    moved = tuple(replace(s, u=s.u + more) for s in walk.samples[name])
    R = walk.traces.config.planner.R
    per_robot = 4 * (R[0] * 1.0 + R[2] * 4.0)
    found = compute_figures(replace(walk, samples={**walk.samples, name: moved}))
    assert found.cost_forces == pytest.approx(per_robot / len(walk.samples), rel=1e-9)


def fallen_at(traces: Traces, robot: str, tick: int) -> Traces:
    event = Event(tick, tick * 1_000_000, "fall", robot, "", "fall")
    return replace(traces, events=(*traces.events, event))


def test_figures_end_with_the_first_fall(walk: Walk) -> None:
    found = compute_figures(replace(walk, traces=fallen_at(walk.traces, "r1", 4000)))
    assert found.fallen == {"r1": 4.0}
    assert found.seconds == 4.0
    assert found.rmse["vx"] == pytest.approx(SPEED - walk.traces.config.reference.vx, rel=1e-6)
    early = compute_figures(replace(walk, traces=fallen_at(walk.traces, "r1", 700)))
    assert early.cost is None
    assert set(early.rmse.values()) == set(early.mean.values()) == {None}


def test_a_robot_that_lies_down_has_fallen_even_if_nobody_says_so(walk: Walk) -> None:
    truth = walk.traces.truth
    y = truth.y.copy()
    y[300:, 0, 0] = 0.05
    traces = replace(walk.traces, truth=replace(truth, y=y))
    assert compute_figures(replace(walk, traces=traces)).fallen == {"r1": truth.tick[300] / 1000}


def test_a_robot_that_stopped_says_why(walk: Walk) -> None:
    statuses = dict(walk.traces.statuses)
    *before, last = statuses["r1"]
    statuses["r1"] = (*before, replace(last, mode="stopping", reason="peer-lost:r2"))
    found = compute_figures(replace(walk, traces=replace(walk.traces, statuses=statuses)))
    assert found.stopped == {"r1": "peer-lost:r2"}


def test_plans_are_counted_by_status(walk: Walk) -> None:
    plans = sum(len(found) for found in walk.traces.plans.values())
    assert plans > 0
    assert compute_figures(walk).plans == {"solved": plans}
