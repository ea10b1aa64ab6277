"""A process of a team that walks is killed and started again: it joins, and the team goes on."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.recordings.check import check
from quadriga.recordings.traces import read_traces
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.codes import FALL, INPUT_LOST, LINK_BACK, LOWERED, RESUMED, STANDS_AGAIN
from quadriga.shared.wire.messages import Event
from quadriga.shared.wire.topics import AGENT_EVENT, EVENT, TRUTH, find_topic
from quadriga.team.launch import Launch, router_row
from tests.runtime.conftest import WAIT, Make, Team
from tests.runtime.frozen import await_tick

pytestmark = pytest.mark.usefixtures("_alone", "_compiled")

Watcher = Callable[..., Bus]
News = tuple[str, str]  # robot, code of an event
REAL = {
    "world__mode": "realtime",
    "world__seconds": 600.0,
    "team__auto_resume": True,
    "recorder__enabled": True,
}
ALL_WALK = {("r1", RESUMED), ("r2", RESUMED)}


def await_news(bus: Bus, *wanted: News) -> None:
    """Wait until all of these have been told, and nobody has fallen."""
    missing, deadline = set(wanted), monotonic() + WAIT
    while missing:
        assert monotonic() < deadline, f"never told: {missing}"
        packet = bus.get(1.0)
        topic = None if packet is None else find_topic(packet[0])[0]
        if packet is not None and topic is not None and topic.type is Event:
            event = decode(packet[1], Event)
            assert event.code != FALL, event
            missing.discard((event.robot, event.code))


def kill(running: Launch, name: str) -> None:
    os.kill(running.pids[name], signal.SIGKILL)


def await_file(path: Path) -> None:
    deadline = monotonic() + WAIT
    while not (path.exists() and path.stat().st_size > 1 << 16):
        assert monotonic() < deadline
        sleep(0.05)


def test_an_agent_an_operator_and_a_recorder(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str]
) -> None:
    team = make_team(**REAL)
    with team.launch(standing=False) as running:
        bus = watcher(team, EVENT, AGENT_EVENT, TRUTH)
        await_tick(bus, 1500)
        kill(running, "r2")
        await_news(bus, ("r1", INPUT_LOST), ("r2", LOWERED))
        running.restart("r2")
        await_news(bus, ("r2", STANDS_AGAIN), *ALL_WALK)
        kill(running, "operator")
        await_news(bus, ("r1", INPUT_LOST), ("r2", INPUT_LOST))
        running.restart("operator")
        await_news(bus, *ALL_WALK)
        kill(running, "recorder")
        running.restart("recorder")
        await_file(team.folder / "run.2.mcap")
        running.watch(lambda: True)
    check_files(team, capsys)


def check_files(team: Team, capsys: pytest.CaptureFixture[str]) -> None:
    """The first recorder's file is as it was left; the second's tells what is between them."""
    first, second = team.folder / "run.mcap", team.folder / "run.2.mcap"
    assert not Recording(first).complete
    found = {finding.name: finding for finding in check(second)}
    assert found["continued"].first[0].got.endswith("of run.mcap")
    assert found["whole"].passed
    capsys.readouterr()
    assert main(["replay", str(first), "--robot", "r2"]) == 2, "its recorder was killed"
    said = capsys.readouterr().out
    assert re.search(r"2 lives, each replayed by itself, from ticks [01], \d+", said)
    assert "differ" not in said


def test_a_router_and_the_word_to_go_on(make_team: Make, watcher: Watcher) -> None:
    team = make_team(bus__mode="client", **REAL | {"team__auto_resume": False})
    rows = (router_row(team.config, team.folder), *team.rows(standing=False))
    with Launch(rows, team.folder / "logs") as running:
        team.await_log("router", "routing at")
        bus = watcher(team, EVENT, AGENT_EVENT, TRUTH)
        await_tick(bus, 1500)
        kill(running, "router")
        running.restart("router")
        await_news(bus, ("r1", STANDS_AGAIN), ("r2", STANDS_AGAIN), ("", LINK_BACK))
        assert main(["resume", "--config", str(team.folder / "config.toml")]) == 0
        await_news(bus, *ALL_WALK)
        running.watch(lambda: True)
    told = {event.code for event in read_traces(team.recording()).events}
    assert LINK_BACK in told, "one recording, with a gap in its midst"
