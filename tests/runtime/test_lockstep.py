"""A team of processes in lock-step: complete, deterministic, undisturbed by what is malformed."""

from __future__ import annotations

import hashlib
import re
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from quadriga.shared.bus.session import READY, Bus
from quadriga.shared.codec import M, decode, encode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Command, Event, Reference, State, Status, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import ESTOP, EVENT, STATUS, TABLE, TRUTH
from tests.runtime.conftest import BEGUN, WAIT, Make, Team, run_alone


def test_every_tick_is_answered_and_recorded_and_everyone_leaves(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=1.0)
    recording = team.run()
    for robot in ("r1", "r2"):
        assert [m.tick for m in recording.messages(State, robot)] == list(range(1000))
        assert [m.tick for m in recording.messages(Command, robot)] == list(range(1000))
    assert [m.tick for m in recording.messages(Truth)] == list(range(0, 1000, 10))
    assert {m.tick for m in recording.messages(Reference)} >= set(range(0, 1300, 100))
    events = [(m.tick, m.kind, m.detail) for m in recording.messages(Event)]
    assert events[0][1] == "start"
    assert events[-1] == (1000, "stop", "end of world.duration")


def test_the_end_comes_a_second_after_a_fall(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=9.0, world__push="r1:2000:0:0.1:0.2")
    events = list(team.run().messages(Event))
    fall = next(m for m in events if m.kind == "fall")
    assert (events[-1].kind, events[-1].tick) == ("stop", fall.tick + 1000)
    assert "fall of" in events[-1].detail


@pytest.mark.usefixtures("_compiled")
def test_two_runs_of_one_scenario_give_the_same_bytes(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=0.8, estimator__kind="kalman")
    digests = []
    for run in ("first", "second"):
        folder = team.folder / run
        folder.mkdir()
        digests.append(payloads(Team(team.config, folder).run(standing=False)))
    assert {"team/r1/command", "team/r2/measurement", "team/reference"} <= digests[0].keys()
    assert digests[0] == digests[1]


def payloads(recording: Recording) -> dict[str, str]:
    """Digest of the payloads of every key, in order; `status` carries wall-clock times."""
    found: dict[str, Any] = defaultdict(hashlib.sha256)
    for entry in recording.entries():
        if not entry.key.endswith("/status"):
            found[entry.key].update(len(entry.payload).to_bytes(4) + entry.payload)
    return {key: digest.hexdigest() for key, digest in found.items()}


@pytest.mark.usefixtures("_compiled")
def test_malformed_messages_on_every_key_are_dropped_and_counted(
    make_team: Make, watcher: Callable[..., Bus]
) -> None:
    team = make_team(recorder__enabled=True, world__duration=600.0)
    with team.launch(standing=False) as running:
        bus = watcher(team)
        assert bus.wait_for(READY, {"sim"}, WAIT, lambda: False)
        inject_noise(bus, team)
        team.await_log("sim", "commands dropped")
        await_tick(bus, team, 1000)
        running.watch(lambda: True)
    recording = team.recording()
    events = valid(recording, EVENT.key("team"), Event)
    faults = [m.detail for m in events if m.kind == "fault"]
    assert any("commands dropped" in fault for fault in faults), faults
    for robot in ("r1", "r2"):
        last = valid(recording, STATUS.key("team", robot), Status)[-1]
        assert last.mode == "walk"
        for name in ("state", "reference", "sim/event"):
            assert last.counters[f"dropped_{name}"] >= 4, (robot, name, last.counters)


def await_tick(bus: Bus, team: Team, tick: int) -> None:
    """Wait until the world has come to a tick."""
    deadline, now = monotonic() + WAIT, 0
    while now < tick:
        assert monotonic() < deadline
        packet = bus.get(1.0)
        if packet is not None and packet[0] == TRUTH.key(team.config.team.name):
            with suppress(MessageError):
                now = decode(packet[1], Truth).tick


def valid(recording: Recording, key: str, kind: type[M]) -> list[M]:
    """The messages of a key among what else was published there."""
    found = []
    for entry in recording.entries():
        if entry.key == key:
            with suppress(MessageError):
                found.append(decode(entry.payload, kind))
    return found


def inject_noise(bus: Bus, team: Team) -> None:
    """Publish what is no message on every key of the team, but where it is an emergency stop."""
    nan = np.full(12, np.nan)
    noise = [
        b"",
        b"\xc1\xff",
        b"\x81\xa6schema\x01",
        bytes(70_000),
        encode(Command(1, 1, nan, nan, nan, nan, nan)),
    ]
    for topic in (topic for topic in TABLE if topic is not ESTOP):
        for robot in robot_names(team.config.team.robots) if topic.per_robot else ("",):
            put = bus.publisher(topic.key(team.config.team.name, robot))
            for payload in noise:
                put(payload)


def test_real_time_says_what_came_late(make_team: Make) -> None:
    team = make_team(team__robots=1, world__mode="realtime", world__duration=1.0)
    with team.launch() as running:
        running.watch(lambda: False)
    last = team.log("sim").splitlines()[-1]
    # Whether the robot stands so long on a busy machine is not the subject.
    assert re.fullmatch(r"\d+ ms: time-over  .+; late ticks: .+; overruns of the world: \d+", last)


def test_a_second_team_does_not_disturb_the_first(make_team: Make) -> None:
    team = make_team(team__robots=1, recorder__enabled=True, world__duration=600.0)
    intruders = team.folder / "intruders"
    intruders.mkdir()
    second = Team(team.config, intruders)
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        rows = [row for row in second.rows(standing=False) if row.name in ("sim", "r1")]
        with ThreadPoolExecutor() as side_by_side:
            (sim_status, sim_said), (agent_status, agent_said) = side_by_side.map(run_alone, rows)
        running.watch(lambda: True)
    assert (sim_status, agent_status) == (2, 2)
    assert "Address already in use" in sim_said
    assert "a team that walks already" in agent_said
    ticks = [m.tick for m in team.recording().messages(Command, "r1")]
    assert ticks == list(range(len(ticks)))
    assert "fault" not in team.log("sim")
