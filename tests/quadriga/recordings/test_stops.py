"""Why robots stopped: as they say, or as the plant saw of a controller that need not say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.recordings.stops import find_stops
from quadriga.recordings.traces import Traces, read_traces
from quadriga.shared import codes
from quadriga.shared.messages import Event
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import COMMAND
from quadriga.team.run_summary import has_failed


@pytest.fixture(scope="module")
def traces(known_run: Path) -> Traces:
    return read_traces(Recording(known_run / "run.mcap"))


def with_events(traces: Traces, *events: Event, controller: str = "walk") -> Traces:
    team = replace(traces.config.team, agent_command=controller)
    return replace(traces, config=replace(traces.config, team=team), events=events)


def test_what_the_plant_saw_counts_of_a_controller_of_ones_own(traces: Traces) -> None:
    gone = Event.of(700, codes.COMMAND_LOST, "", "r2, r1 gone")
    reason = "command-lost:r2, r1 gone"
    assert find_stops(with_events(traces, gone)) == {"r1": reason, "r2": reason}
    silent = Event.of(500, codes.COMMAND_LOST, "", "r1 silent for 10 s")
    assert find_stops(with_events(traces, silent, controller="")) == {
        "r1": "command-lost:r1 silent for 10 s"
    }


def test_a_robot_that_never_sent_a_command_has_failed(traces: Traces) -> None:
    key = COMMAND.key(traces.config.team.name, "r2")
    mute = replace(traces, messages={k: n for k, n in traces.messages.items() if k != key})
    stops = find_stops(with_events(mute, controller=""))
    assert stops == {"r2": "command-lost:it has never sent a command"}
    assert has_failed({"fell": False, "lost": 0, "stop_reasons": stops})
