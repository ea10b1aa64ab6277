"""A team of processes in lock-step: complete, deterministic, undisturbed by what is malformed."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from quadriga.shared.bus.session import READY, Bus
from quadriga.shared.codec import M, decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Command, Event, Reference, State, Status, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import COMMAND, ESTOP, EVENT, STATE, STATUS, TABLE
from tests.listening import WAIT
from tests.runtime.conftest import FOREVER, Make, Team, Watcher, await_tick, digests, router
from tests.runtime.fortress import make_fortress, serving


def test_every_tick_is_answered_and_routers_change_nothing(make_team: Make) -> None:
    """One of plain TCP, which comes last and leaves after the walk, and one of certificates."""
    team = make_team(recorder__enabled=True, world__duration=0.5)
    recording = team.run()
    for robot in ("r1", "r2"):
        assert [m.tick for m in recording.messages(State, robot)] == list(range(500))
        assert [m.tick for m in recording.messages(Command, robot)] == list(range(500))
    assert [m.tick for m in recording.messages(Truth)] == list(range(0, 500, 10))
    assert {m.tick for m in recording.messages(Reference)} >= set(range(0, 800, 100))
    events = [(m.tick, m.kind, m.detail) for m in recording.messages(Event)]
    assert events[0][1] == "start"
    assert events[-1] == (500, "stop", "end of world.duration")
    expected, bus = digests(recording), team.config.bus

    routed = within(team, "routed", replace(team.config, bus=replace(bus, mode="client")))
    options = ("--once", "--set", f"bus.barrier_timeout={WAIT:g}")
    with routed.launch() as running, router(bus.endpoint, *options, says="") as process:
        running.watch(lambda: False)
        assert process.wait(WAIT) == 0
    assert digests(routed.recording()) == expected

    secure = within(team, "secure", team.config)
    own = make_fortress(secure.folder)
    config = replace(team.config, bus=replace(own.config.bus, barrier_timeout=WAIT))
    with serving(own):
        assert digests(replace(secure, config=config).run()) == expected


def within(team: Team, name: str, config: Config | None = None) -> Team:
    """A team with a folder of its own."""
    folder = team.folder / name
    folder.mkdir()
    return replace(team, folder=folder, config=config or team.config)


def test_the_end_comes_a_second_after_a_fall(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=9.0, world__push="r1:2000:0:0.1:0.2")
    events = list(team.run().messages(Event))
    fall = next(m for m in events if m.kind == "fall")
    assert (events[-1].kind, events[-1].tick) == ("stop", fall.tick + 1000)
    assert "fall of" in events[-1].detail


@pytest.mark.usefixtures("_compiled")
def test_two_runs_of_one_scenario_give_the_same_bytes(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=0.8, estimator__kind="kalman")
    first, second = (digests(within(team, name).run(standing=False)) for name in ("a", "b"))
    assert {"team/r1/command", "team/r2/measurement", "team/reference"} <= first.keys()
    assert first == second


@pytest.mark.usefixtures("_compiled")
def test_malformed_messages_on_every_key_are_dropped_and_counted(
    make_team: Make, watcher: Watcher
) -> None:
    team = make_team(recorder__enabled=True, world__duration=FOREVER, plant__link="bus")
    with team.launch(standing=False) as running:
        bus = watcher(team)
        assert bus.wait_for(READY, {"sim"}, WAIT, lambda: False)
        inject_noise(bus, team)
        team.await_log("sim", "commands dropped")
        await_tick(bus, 1000)
        running.watch(lambda: True)
    recording = team.recording()
    faults = [m.detail for m in valid(recording, EVENT.key("team"), Event) if m.kind == "fault"]
    assert any("commands dropped" in fault for fault in faults), faults
    for robot in ("r1", "r2"):
        last = valid(recording, STATUS.key("team", robot), Status)[-1]
        assert last.mode == "walk"
        for name in ("state", "reference", "sim/event"):
            assert last.counters[f"dropped_{name}"] >= 4, (robot, name, last.counters)


def valid(recording: Recording, key: str, kind: type[M]) -> list[M]:
    """The messages of a key among what else was published there."""
    found = []
    for entry in recording.entries():
        if entry.key == key:
            with suppress(MessageError):
                found.append(decode(entry.payload, kind))
    return found


def inject_noise(bus: Bus, team: Team) -> None:
    """Publish what is no message on every key of the team, but the emergency stop's."""
    nan = np.full(12, np.nan)
    forged = encode(Command(1, 1, nan, nan, nan, nan, nan))
    name, robots = team.config.team.name, robot_names(team.config.team.robots)
    keys = [topic.link_key(name, robot) for topic in (STATE, COMMAND) for robot in robots]
    for topic in (topic for topic in TABLE if topic is not ESTOP):
        keys += [topic.key(name, robot) for robot in (robots if topic.per_robot else ("",))]
    for put in map(bus.publisher, keys):
        for payload in (b"", b"\xc1\xff", b"\x81\xa6schema\x01", bytes(70_000), forged):
            put(payload)


def test_real_time_says_what_came_late(make_team: Make) -> None:
    team = make_team(team__robots=1, world__mode="realtime", world__duration=1.0)
    with team.launch() as running:
        running.watch(lambda: False)
    last = team.log("sim").splitlines()[-1]
    # Whether the robot stands so long on a busy machine is not the subject.
    assert re.fullmatch(r"\d+ ms: time-over  .+; late ticks: .+; overruns of the world: \d+", last)
