"""A fall is what the world counts as one: not what an emergency stop lets down, but all else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadriga.experiments.trial.figures_of_merit import Walk, compute_figures
from quadriga.experiments.trial.over_bus import read_walk
from quadriga.plant.commands import damp_joints
from quadriga.recordings.falls import find_falls
from quadriga.recordings.summary import summary_of
from quadriga.recordings.traces import Traces
from quadriga.recordings.truth import build_truth_trace
from quadriga.shared.codes import ESTOPPED, FALL, RESET
from quadriga.shared.messages import Event
from quadriga.shared.recording.metadata import LOST
from quadriga.sim_server.world.world import World
from quadriga.team.run_summary import has_failed
from tests.sim_server.standing import configured, stand

HIGH, LOW, TILTED, ON_ITS_SIDE = (0.26, 0.0), (0.08, 0.1), (0.2, 1.2), (0.08, 1.2)
Course = Mapping[int, tuple[float, float]]  # from a tick on: height over the ground, m, and tilt


@pytest.fixture(scope="module")
def walk(known_run: Path) -> Walk:
    return read_walk(known_run / "run.mcap")


def moved(traces: Traces, course: Course, *events: Event) -> Traces:
    """The walk with r1 on another course."""
    truth = traces.truth
    y, tilt = truth.y.copy(), truth.tilt.copy()
    for begin, (height, angle) in sorted(course.items()):
        y[truth.tick >= begin, 0, 0] = height
        tilt[truth.tick >= begin, 0] = angle
    return replace(traces, truth=replace(truth, y=y, tilt=tilt), events=events)


def told(tick: int, code: str, robot: str = "") -> Event:
    return Event.of(tick, code, robot, "")


STOP, RELEASE = told(2000, ESTOPPED), told(3000, RESET)


@pytest.mark.parametrize(
    ("course", "events", "fell"),
    [
        ({2000: LOW}, (), 2000),
        ({2010: LOW}, (STOP,), None),
        ({2010: LOW}, (told(2000, ESTOPPED, "r1"),), None),
        ({2010: LOW}, (told(2000, ESTOPPED, "r2"),), 2010),
        ({2010: TILTED, 2200: ON_ITS_SIDE}, (STOP,), None),
        ({1900: LOW}, (STOP,), 1900),
        ({2000: LOW}, (STOP,), 2000),
        ({2010: LOW, 4000: HIGH}, (STOP, RELEASE), None),
        ({2010: ON_ITS_SIDE, 4000: HIGH}, (STOP, RELEASE), None),
        ({2010: LOW, 4000: ON_ITS_SIDE}, (STOP, RELEASE), None),
        ({2010: HIGH, 4000: ON_ITS_SIDE}, (STOP, RELEASE), 4000),
        ({2010: LOW, 4000: HIGH, 5000: LOW}, (STOP, RELEASE), 5000),
        ({2010: LOW, 4000: HIGH, 5000: LOW}, (STOP, RELEASE, told(4900, ESTOPPED)), None),
    ],
)
def test_what_the_world_let_down_has_not_fallen_and_all_else_has(
    walk: Walk, course: Course, events: tuple[Event, ...], fell: int | None
) -> None:
    traces = moved(walk.traces, course, *events)
    assert find_falls(traces) == ({} if fell is None else {"r1": fell})
    summary, figures = summary_of(traces), compute_figures(replace(walk, traces=traces))
    assert summary["fallen"] == sorted(figures.fallen) == ([] if fell is None else ["r1"])
    assert has_failed(summary) is (fell is not None)


@pytest.mark.parametrize("stopped", [True, False], ids=["stopped", "limp"])
def test_it_is_the_rule_of_the_world_itself(walk: Walk, stopped: bool) -> None:
    """A robot whose joints are damped sinks to the ground, by a stop or without anybody's word."""
    config = configured(1)
    world = World(config)
    stand(world, 300)
    events, truths = [told(world.tick, ESTOPPED)] if stopped else [], [world.truth()]
    world.expect_down(world.names if stopped else ())
    for _ in range(1500):
        events.extend(world.step({"r1": damp_joints(world.tick)}))
        truths.append(world.truth())
    truth = build_truth_trace(truths, config)
    traces = replace(walk.traces, config=config, robots=("r1",), truth=truth, events=tuple(events))
    silent = replace(traces, events=tuple(e for e in events if e.code != FALL))
    assert truth.down[-1, 0]
    assert find_falls(traces) == find_falls(silent)
    assert list(find_falls(silent)) == list(world.fallen()) == ([] if stopped else ["r1"])


def test_a_walk_that_was_stopped_has_not_failed(walk: Walk) -> None:
    """What `quadriga walk` ends with: 0 after a stop that somebody has asked for."""
    traces = moved(walk.traces, {2010: LOW}, STOP)
    *before, last = traces.statuses["r1"]
    for reason, failed in (("estop:dog", False), ("stopped:lunch", False), ("peer-lost:r2", True)):
        own = (*before, replace(last, mode="estop", reason=reason))
        ended = replace(traces, statuses={**traces.statuses, "r1": own})
        summary = summary_of(ended)
        assert has_failed(summary) is failed
        lossy = replace(ended, notes={LOST: {"team/r1/state": "57336"}})
        assert has_failed(summary_of(lossy)), "the recorder did not hear all"
    assert np.isfinite(summary["distance"])
