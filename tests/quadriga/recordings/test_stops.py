"""Why robots stopped: as they say, or as the plant saw of a controller that need not say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.recordings.stops import find_stops
from quadriga.recordings.traces import Traces, read_traces
from quadriga.shared.recording.reader import Recording
from quadriga.shared.wire import codes
from quadriga.shared.wire.messages import Event


@pytest.fixture(scope="module")
def traces(known_run: Path) -> Traces:
    return read_traces(Recording(known_run / "run.mcap"))


def with_events(traces: Traces, *events: Event, controller: str = "walk") -> Traces:
    team = replace(traces.config.team, controller=controller)
    return replace(traces, config=replace(traces.config, team=team), events=events)


def test_what_the_plant_saw_counts_of_a_controller_of_ones_own(traces: Traces) -> None:
    silent = Event.of(500, codes.SILENT, "r1", "silent for 10 s")
    back, gone = Event.of(600, codes.BACK, "r1", ""), Event.of(700, codes.GONE, "r2", "gone")
    assert find_stops(with_events(traces, silent, gone)) == {
        "r1": "silent:silent for 10 s",
        "r2": "gone:gone",
    }
    assert find_stops(with_events(traces, silent, back)) == {}
    assert find_stops(with_events(traces, silent, controller="")) == {}
