"""Real sessions say who they are, wait with reasons, and refuse those that differ."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace

import pytest

from quadriga.shared.about import About, about_key
from quadriga.shared.bus import discovery
from quadriga.shared.bus.discovery import (
    ProcessInfo,
    ask,
    await_members,
    check_others,
    describe_process,
    join,
    start_together,
    view_of,
)
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import wall_ns
from quadriga.team.endpoint import free_endpoint

NAMES = ("sim", "r1", "r2", "operator")
Open = Callable[[str], Bus]
Met = dict[str, Future[bool]]


def never() -> bool:
    return False


@pytest.fixture
def config() -> Config:
    keys = {
        "team.robots": 2,
        "bus.endpoint": free_endpoint(),
        "recorder.enabled": False,
        "bus.barrier_timeout": 20.0,
    }
    return load(None, keys)


@pytest.fixture
def opened(config: Config) -> Iterator[Open]:
    """A function that opens a bus of the team, by name; all are closed at last."""
    with ExitStack() as stack:
        yield lambda name: stack.enter_context(Bus.open(config.bus, "team", name))


@pytest.fixture
def buses(opened: Open) -> dict[str, Bus]:
    return {name: opened(name) for name in NAMES}


def all_meet(config: Config, buses: dict[str, Bus], **introductions: ProcessInfo) -> Met:
    """What comes of the meeting for each; all are introduced before the first looks."""
    said = {name: introductions.get(name) or ProcessInfo(b, config) for name, b in buses.items()}
    with ThreadPoolExecutor(len(buses)) as pool:
        return {n: pool.submit(join, b, config, never, said[n]) for n, b in buses.items()}


def make_ready(buses: dict[str, Bus], *names: str) -> None:
    for name in names:
        buses[name].declare(HERE)
        buses[name].declare(READY)


def other_version(config: Config, name: str) -> Callable[[], bytes]:
    newer = encode(replace(describe_process(config, name), version="9.0.0"))
    return lambda: newer


def test_an_answer_survives_the_wire_and_is_small() -> None:
    said = describe_process(load(None, {"team.robots": 10}), "r1", "ab" * 32)
    payload = encode(said)
    assert decode(payload, About) == said
    assert len(payload) < 16_384


def test_a_process_says_who_it_is_and_how_far(config: Config, buses: dict[str, Bus]) -> None:
    before = wall_ns()
    met = all_meet(config, buses, r1=ProcessInfo(buses["r1"], config, "ab" * 32))
    assert all(future.result() for future in met.values())
    buses["operator"].declare(READY)
    told = ask(buses["sim"])
    assert told.keys() == {*NAMES}
    (said,) = told["r1"]
    about = said.about
    assert about is not None
    assert (about.name, about.host, about.pid) == ("r1", socket.gethostname(), os.getpid())
    assert (about.stage, about.predictor) == ("warming-up", "ab" * 32)
    assert about.sees == ("operator", "r2", "sim")
    assert before <= said.asked_ns <= about.wall_ns <= said.arrived_ns <= wall_ns()
    view = view_of(buses["sim"], config, told)
    stages = {name: its.stage for name in NAMES if (its := view.about(name))}
    assert stages == {**dict.fromkeys(NAMES, "warming-up"), "operator": "ready"}
    assert view.lead is not None
    assert view.planner is not None
    assert (view.lead.name, view.planner.name) == ("sim", "r1")


@pytest.mark.parametrize("of", ["configuration", "predictor"])
def test_who_differs_leaves_and_the_right_one_takes_its_place(
    config: Config, buses: dict[str, Bus], opened: Open, of: str
) -> None:
    seed = 4 if of == "configuration" else config.world.seed
    digests = {"r1": "a" * 64, "r2": "b" * 64 if of == "predictor" else "a" * 64}
    other = replace(config, world=replace(config.world, seed=seed))
    said = {"r1": ProcessInfo(buses["r1"], config, digests["r1"])}
    met = all_meet(config, buses, **said, r2=ProcessInfo(buses["r2"], other, digests["r2"]))
    differs = {
        "configuration": "world.seed=4, sim has world.seed=0",
        "predictor": f"{'b' * 12}, r1 has {'a' * 12}",
    }
    with pytest.raises(BusError, match=f"^r2 of team 'team': got another {of}: {differs[of]}, exp"):
        met.pop("r2").result()
    assert all(future.result() for future in met.values())
    buses.pop("r2").close()
    right = opened("r2")
    assert join(right, config, never)
    for bus in (right, buses["r1"], buses["operator"]):
        bus.declare(READY)
    assert start_together(buses["sim"], config, never)


@pytest.mark.parametrize(
    ("says", "error"),
    [
        ("version", r"another version: 9\.0\.0, sim has"),
        (None, "no answer that can be read"),
        ("garbage", "no answer that can be read"),
        ("another name", "no answer that can be read"),
    ],
)
def test_no_team_starts_with_one_that_differs_or_does_not_say_what_it_is(
    config: Config,
    buses: dict[str, Bus],
    monkeypatch: pytest.MonkeyPatch,
    says: str | None,
    error: str,
) -> None:
    """Even if it does not leave by itself."""
    monkeypatch.setattr(discovery, "_PATIENCE", 0.3)
    for name in ("sim", "r1", "operator"):
        ProcessInfo(buses[name], config)
    answers = {
        "version": other_version(config, "r2"),
        "garbage": lambda: b"garbage",
        "another name": other_version(config, "r1"),
    }
    if says is not None:
        buses["r2"].answer(about_key("team", "r2"), answers[says])
    make_ready(buses, "r1", "r2", "operator")
    with pytest.raises(BusError, match=f"r2 of team 'team': got {error}"):
        start_together(buses["sim"], config, never)
    assert READY not in buses["sim"].reached


def test_a_team_starts_with_controllers_that_do_not_say_what_they_are(
    config: Config, buses: dict[str, Bus]
) -> None:
    """One that does say it must have the same version."""
    team = replace(config.team, agent_command="walk")
    config = replace(config, team=team, planner=replace(config.planner, kind="none"))
    for name in ("sim", "operator"):
        ProcessInfo(buses[name], config)
    make_ready(buses, "r1", "r2", "operator")
    assert start_together(buses["sim"], config, never)
    buses["r2"].answer(about_key("team", "r2"), other_version(config, "r2"))
    while not ask(buses["sim"], ["r2"]):
        pass  # it is known there in a moment
    with pytest.raises(BusError, match=r"r2 of team 'team': got another version: 9\.0\.0, sim has"):
        check_others(buses["sim"], config, NAMES)


def test_who_waits_says_for_whom_and_why_and_does_not_repeat_it(
    config: Config,
    buses: dict[str, Bus],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(discovery, "_QUIET", 0.2)
    monkeypatch.setattr(discovery, "_EVERY", 0.05)
    buses.pop("r2").close()
    buses["r1"].declare(HERE)
    ProcessInfo(buses["operator"], config)
    looks = iter([False] * 200)
    assert not await_members(buses["sim"], config, HERE, {*NAMES}, lambda: next(looks, True))
    assert capsys.readouterr().err == (
        "quadriga: sim waits; r2: not on the bus: not started, failed, or another bus.endpoint or "
        "team.name; operator: on the bus, has not announced itself yet\n"
    )


def test_at_the_end_a_barrier_names_each_reason_in_one_line(
    config: Config, buses: dict[str, Bus]
) -> None:
    met = all_meet(config, buses)
    assert all(future.result() for future in met.values())
    buses.pop("operator").close()
    soon = replace(config, bus=replace(config.bus, barrier_timeout=0.3))
    with pytest.raises(BusError) as caught:
        start_together(buses["sim"], soon, never)
    text = str(caught.value)
    assert "no operator, r1, r2 at stage 'ready' after 0.3 s" in text
    assert "(r1, r2: still warming up; operator: not on the bus: not started, failed" in text
    assert "\n" not in text


def test_without_a_link_it_is_told_whether_somebody_listens(config: Config, opened: Open) -> None:
    soon = replace(config, bus=replace(config.bus, barrier_timeout=0.2))
    with pytest.raises(BusError) as caught:
        join(opened("r1"), soon, never)
    assert f"no link to anyone; nobody listens at {config.bus.endpoint})" in str(caught.value)


@pytest.mark.parametrize("again", ["r2", "operator"])
def test_nobody_joins_a_team_that_walks(
    config: Config, buses: dict[str, Bus], opened: Open, again: str
) -> None:
    """Even where the process of this name is gone already."""
    assert all(future.result() for future in all_meet(config, buses).values())
    make_ready(buses, "r1", "r2", "operator")
    assert start_together(buses["sim"], config, never)
    with pytest.raises(BusError, match=r"a team that walks already"):
        join(opened("r1"), config, never)
    buses[again].close()
    with pytest.raises(BusError, match="a team that walks already, expected a network without"):
        join(opened(again), config, never)


def test_a_team_does_not_start_with_two_of_one_name(
    config: Config, buses: dict[str, Bus], opened: Open
) -> None:
    assert all(future.result() for future in all_meet(config, buses).values())
    double = opened("r1")
    make_ready({**buses, "double": double}, "r1", "r2", "operator", "double")
    while not buses["sim"].duplicates(HERE):
        buses["sim"].get(0.05)
    with pytest.raises(BusError, match=r"two processes named r1, expected one of each name"):
        start_together(buses["sim"], config, never)
