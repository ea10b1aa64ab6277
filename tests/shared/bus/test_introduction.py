"""Real sessions say who they are, wait with reasons, and refuse those that differ."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace

import pytest

from quadriga.shared.bus import inquiry, watch
from quadriga.shared.bus.barrier import await_members, meet, start_together
from quadriga.shared.bus.inquiry import ask, check_others, view_of
from quadriga.shared.bus.introduction import Introduction, describe_process
from quadriga.shared.bus.zenoh_bus import HERE, READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import wall_ns
from quadriga.shared.wire.about import ABOUT
from quadriga.shared.wire.codec import encode
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
def join(config: Config) -> Iterator[Open]:
    """A function that opens a bus of the team, by name; all are closed at last."""
    with ExitStack() as stack:
        yield lambda name: stack.enter_context(Bus.open(config.bus, "team", name))


@pytest.fixture
def buses(join: Open) -> dict[str, Bus]:
    return {name: join(name) for name in NAMES}


def all_meet(config: Config, buses: dict[str, Bus], **introductions: Introduction) -> Met:
    """What comes of the meeting for each; all are introduced before the first looks."""
    said = {name: introductions.get(name) or Introduction(b, config) for name, b in buses.items()}
    with ThreadPoolExecutor(len(buses)) as pool:
        return {n: pool.submit(meet, b, config, never, said[n]) for n, b in buses.items()}


def seeded(config: Config, seed: int) -> Config:
    return replace(config, world=replace(config.world, seed=seed))


def test_a_process_says_who_it_is_and_how_far(config: Config, buses: dict[str, Bus]) -> None:
    before = wall_ns()
    met = all_meet(config, buses, r1=Introduction(buses["r1"], config, "ab" * 32))
    assert {name: future.result() for name, future in met.items()} == dict.fromkeys(NAMES, True)
    buses["operator"].declare(READY)
    told = ask(buses["sim"])
    assert told.keys() == {*NAMES}
    (said,) = told["r1"]
    assert said.about is not None
    assert (said.about.name, said.about.host, said.about.pid) == (
        "r1",
        socket.gethostname(),
        os.getpid(),
    )
    assert (said.about.stage, said.about.predictor) == ("warming-up", "ab" * 32)
    assert said.about.sees == ("operator", "r2", "sim")
    assert before <= said.asked_ns <= said.about.wall_ns <= said.arrived_ns <= wall_ns()
    view = view_of(buses["sim"], config, told)
    stages = {name: about.stage for name in NAMES if (about := view.about(name))}
    assert stages == {**dict.fromkeys(NAMES, "warming-up"), "operator": "ready"}
    assert view.norm is not None
    assert (view.norm.lead.name, view.norm.predictor) == ("sim", "ab" * 32)


def test_who_differs_leaves_and_the_right_one_takes_its_place(
    config: Config, buses: dict[str, Bus], join: Open
) -> None:
    other = Introduction(buses["r2"], seeded(config, 4))
    met = all_meet(config, buses, r2=other)
    with pytest.raises(BusError) as caught:
        met.pop("r2").result()
    assert str(caught.value).startswith(
        "configuration of r2 in team 'team': got world.seed 4, expected world.seed 0 as sim has it"
    )
    assert all(future.result() for future in met.values())
    buses.pop("r2").close()
    right = join("r2")
    assert meet(right, config, never)
    for bus in (right, buses["r1"], buses["operator"]):
        bus.declare(READY)
    assert start_together(buses["sim"], config, never)


def test_an_agent_with_another_predictor_leaves(config: Config, buses: dict[str, Bus]) -> None:
    said = {n: Introduction(buses[n], config, d * 64) for n, d in (("r1", "a"), ("r2", "b"))}
    met = all_meet(config, buses, **said)
    with pytest.raises(BusError, match=r"predictor of r2 .* got b{12}, expected a{12} as r1"):
        met.pop("r2").result()
    assert all(future.result() for future in met.values())


def make_ready(buses: dict[str, Bus], names: tuple[str, ...]) -> None:
    for name in names:
        buses[name].declare(HERE)
        buses[name].declare(READY)


def test_no_team_starts_with_another_version(config: Config, buses: dict[str, Bus]) -> None:
    """Not even if it does not leave by itself, as an earlier one."""
    for name in ("sim", "r1", "operator"):
        Introduction(buses[name], config)
    newer = encode(replace(describe_process(config, "r2"), version="9.0.0"))
    buses["r2"].answer(ABOUT.key("team", "r2"), lambda: newer)
    make_ready(buses, ("r1", "r2", "operator"))
    with pytest.raises(BusError, match=r"version of r2 in team 'team': got 9\.0\.0, expected"):
        start_together(buses["sim"], config, never)
    assert READY not in buses["sim"].reached


@pytest.mark.parametrize("payload", [None, b"garbage", "r1"])
def test_no_team_starts_with_one_that_does_not_say_what_it_is(
    config: Config,
    buses: dict[str, Bus],
    monkeypatch: pytest.MonkeyPatch,
    payload: bytes | str | None,
) -> None:
    monkeypatch.setattr(inquiry, "_PATIENCE", 0.3)
    if payload is not None:
        named = encode(describe_process(config, "r1"))  # as if it were another
        buses["r2"].answer(
            ABOUT.key("team", "r2"), lambda: named if payload == "r1" else b"garbage"
        )
    for name in ("sim", "r1", "operator"):
        Introduction(buses[name], config)
    make_ready(buses, ("r1", "r2", "operator"))
    with pytest.raises(BusError, match=r"r2 of team 'team': got no answer that can be read"):
        check_others(buses["sim"], config, NAMES)


def test_who_waits_says_for_whom_and_why_and_does_not_repeat_it(
    config: Config,
    buses: dict[str, Bus],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(watch, "_QUIET", 0.2)
    monkeypatch.setattr(watch, "_EVERY", 0.05)
    buses.pop("r2").close()
    buses["r1"].declare(HERE)
    Introduction(buses["operator"], config)
    looked = 0

    def stopped() -> bool:
        nonlocal looked
        looked += 1
        return looked > 200

    assert not await_members(buses["sim"], config, HERE, {*NAMES}, stopped)
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


def test_without_a_link_it_is_told_whether_somebody_listens(config: Config, join: Open) -> None:
    soon = replace(config, bus=replace(config.bus, barrier_timeout=0.2))
    with pytest.raises(BusError) as caught:
        meet(join("r1"), soon, never)
    assert f"no link to anyone; nobody listens at {config.bus.endpoint})" in str(caught.value)


def test_a_team_starts_with_controllers_that_do_not_say_what_they_are(
    config: Config, buses: dict[str, Bus]
) -> None:
    """One that does say it must have the same version."""
    team = replace(config.team, controller="walk")
    config = replace(config, team=team, planner=replace(config.planner, kind="none"))
    for name in ("sim", "operator"):
        Introduction(buses[name], config)
    make_ready(buses, ("r1", "r2", "operator"))
    assert start_together(buses["sim"], config, never)
    newer = encode(replace(describe_process(config, "r2"), version="9.0.0"))
    buses["r2"].answer(ABOUT.key("team", "r2"), lambda: newer)
    while not ask(buses["sim"], ["r2"]):
        pass  # it is known there in a moment
    with pytest.raises(BusError, match=r"version of r2 in team 'team': got 9\.0\.0, expected"):
        check_others(buses["sim"], config, NAMES)
