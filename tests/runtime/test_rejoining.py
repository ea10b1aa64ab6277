"""A process of a team that walks is killed and started again: it joins, and the team goes on."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Collection
from pathlib import Path

import pytest

from quadriga.agents.modes import LOSSES, STAND, WALK
from quadriga.commands.parser import main
from quadriga.recordings.check import check
from quadriga.recordings.traces import read_traces
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.codes import (
    FALL,
    INPUT_LOST,
    LINK_BACK,
    LOWERED,
    RESUMED,
    STANDS_AGAIN,
    code_of,
)
from quadriga.shared.messages import Event, Status
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import EVENT, STATUS, TRUTH, find_topic
from quadriga.team.launch import Launch, router_row
from tests.runtime.conftest import WAIT, Make, Team
from tests.runtime.frozen import await_tick

pytestmark = pytest.mark.usefixtures("_alone", "_compiled")

Watcher = Callable[..., Bus]
Told = tuple[str, str]  # robot, code of an event
IsSo = Callable[[Status], bool]
REAL = {
    "world__mode": "realtime",
    "world__duration": 600.0,
    "team__auto_resume": True,
    "recorder__enabled": True,
}
ROBOTS = ("r1", "r2")


def await_news(bus: Bus, told: Told | None, robots: Collection[str], is_so: IsSo) -> None:
    """Wait for an event, if one is given, and for a status of each of these robots; none may fall.

    A robot sends its status again and again. Of its events a busy machine may miss one, or there
    is none since the robot was in that state before.
    """
    missing, deadline = set(robots), monotonic() + WAIT
    while missing or told is not None:
        assert monotonic() < deadline, f"never so: {missing or told}"
        packet = bus.get(1.0)
        topic, robot = (None, "") if packet is None else find_topic(packet[0])
        if packet is None or topic is None:
            continue
        if topic == EVENT:
            event = decode(packet[1], Event)
            assert event.code != FALL, event
            told = None if (event.robot, event.code) == told else told
        elif topic == STATUS and robot in missing and is_so(decode(packet[1], Status)):
            missing.remove(robot)


def walks(status: Status) -> bool:
    return status.mode == WALK


def stands_for_a_loss(status: Status) -> bool:
    return status.mode == STAND and code_of(status.reason) in LOSSES


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
        bus = watcher(team, EVENT, STATUS, TRUTH)
        await_tick(bus, 1500)
        kill(running, "r2")
        await_news(bus, ("r2", LOWERED), ["r1"], stands_for_a_loss)
        running.restart("r2")
        await_news(bus, None, ROBOTS, walks)
        kill(running, "operator")
        await_news(bus, None, ROBOTS, stands_for_a_loss)
        running.restart("operator")
        await_news(bus, None, ROBOTS, walks)
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
    told = {(event.robot, event.code) for event in read_traces(Recording(first)).events}
    both = {(robot, code) for robot in ROBOTS for code in (INPUT_LOST, RESUMED)}
    assert told >= {("r2", LOWERED), ("r2", STANDS_AGAIN), *both}
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
        bus = watcher(team, EVENT, STATUS, TRUTH)
        await_tick(bus, 1500)
        kill(running, "router")
        sleep(1.0)  # a fast machine has it back before anybody stands
        running.restart("router")
        await_news(bus, ("", LINK_BACK), ROBOTS, stands_for_a_loss)
        # On a busy machine not all may have said within its time that they walk.
        deadline = monotonic() + WAIT
        while main(["resume", "--config", str(team.folder / "config.toml")]) != 0:
            assert monotonic() < deadline
        await_news(bus, None, ROBOTS, walks)
        running.watch(lambda: True)
    told = {(event.robot, event.code) for event in read_traces(team.recording()).events}
    assert told >= {("", LINK_BACK), *((robot, STANDS_AGAIN) for robot in ROBOTS)}, (
        "one recording, with a gap in its midst"
    )
