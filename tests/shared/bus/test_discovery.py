"""Real sessions say who they are, wait with reasons, and refuse those that differ."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from threading import Thread

import pytest

from quadriga.shared.about import ABOUT
from quadriga.shared.bus import discovery
from quadriga.shared.bus.discovery import (
    REJOINS,
    STARTS,
    ask,
    await_members,
    check_others,
    join,
    start_together,
    view_of,
)
from quadriga.shared.bus.membership import members
from quadriga.shared.bus.process_info import ProcessInfo, describe_process
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import wall_ns
from quadriga.team.endpoint import free_endpoint

NAMES = ("sim", "r1", "r2", "operator")
Open = Callable[[str], Bus]
Met = dict[str, Future[str]]


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


def seeded(config: Config, seed: int) -> Config:
    return replace(config, world=replace(config.world, seed=seed))


def test_a_process_says_who_it_is_and_how_far(config: Config, buses: dict[str, Bus]) -> None:
    before = wall_ns()
    met = all_meet(config, buses, r1=ProcessInfo(buses["r1"], config, "ab" * 32))
    assert {name: future.result() for name, future in met.items()} == dict.fromkeys(NAMES, STARTS)
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
    config: Config, buses: dict[str, Bus], opened: Open
) -> None:
    other = ProcessInfo(buses["r2"], seeded(config, 4))
    met = all_meet(config, buses, r2=other)
    with pytest.raises(BusError) as caught:
        met.pop("r2").result()
    assert str(caught.value).startswith(
        "configuration of r2 in team 'team': got world.seed 4, expected world.seed 0 as sim has it"
    )
    assert all(future.result() for future in met.values())
    buses.pop("r2").close()
    right = opened("r2")
    assert join(right, config, never)
    for bus in (right, buses["r1"], buses["operator"]):
        bus.declare(READY)
    assert start_together(buses["sim"], config, never)


def test_an_agent_with_another_predictor_leaves(config: Config, buses: dict[str, Bus]) -> None:
    said = {n: ProcessInfo(buses[n], config, d * 64) for n, d in (("r1", "a"), ("r2", "b"))}
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
        ProcessInfo(buses[name], config)
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
    monkeypatch.setattr(discovery, "_PATIENCE", 0.3)
    if payload is not None:
        named = encode(describe_process(config, "r1"))  # as if it were another
        buses["r2"].answer(
            ABOUT.key("team", "r2"), lambda: named if payload == "r1" else b"garbage"
        )
    for name in ("sim", "r1", "operator"):
        ProcessInfo(buses[name], config)
    make_ready(buses, ("r1", "r2", "operator"))
    with pytest.raises(BusError, match=r"r2 of team 'team': got no answer that can be read"):
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


def test_without_a_link_it_is_told_whether_somebody_listens(config: Config, opened: Open) -> None:
    soon = replace(config, bus=replace(config.bus, barrier_timeout=0.2))
    with pytest.raises(BusError) as caught:
        join(opened("r1"), soon, never)
    assert f"no link to anyone; nobody listens at {config.bus.endpoint})" in str(caught.value)


def test_a_team_starts_with_controllers_that_do_not_say_what_they_are(
    config: Config, buses: dict[str, Bus]
) -> None:
    """One that does say it must have the same version."""
    team = replace(config.team, agent_command="walk")
    config = replace(config, team=team, planner=replace(config.planner, kind="none"))
    for name in ("sim", "operator"):
        ProcessInfo(buses[name], config)
    make_ready(buses, ("r1", "r2", "operator"))
    assert start_together(buses["sim"], config, never)
    newer = encode(replace(describe_process(config, "r2"), version="9.0.0"))
    buses["r2"].answer(ABOUT.key("team", "r2"), lambda: newer)
    while not ask(buses["sim"], ["r2"]):
        pass  # it is known there in a moment
    with pytest.raises(BusError, match=r"version of r2 in team 'team': got 9\.0\.0, expected"):
        check_others(buses["sim"], config, NAMES)


def team(**more: object) -> Config:
    keys = {
        "team.robots": 1,
        "bus.endpoint": free_endpoint(),
        "recorder.enabled": False,
        "bus.barrier_timeout": 10.0,
    }
    return load(None, {**keys, **more})


def test_members() -> None:
    assert members(team()) == {"sim", "operator", "r1"}
    three = load(None, {"team.robots": 3})
    assert members(three) == {"sim", "operator", "recorder", "r1", "r2", "r3"}


def enter(config: Config, name: str) -> Bus:
    return Bus.open(config.bus, config.team.name, name)


def meet_all(config: Config, *buses: Bus) -> None:
    threads = [Thread(target=join, args=(bus, config, never)) for bus in buses]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def test_the_world_starts_when_all_are_ready_and_nobody_joins_later() -> None:
    config = team()
    with (
        enter(config, "sim") as sim,
        enter(config, "r1") as r1,
        enter(config, "operator") as operator,
    ):
        meet_all(config, sim, r1, operator)
        r1.declare(READY)
        operator.declare(READY)
        assert start_together(sim, config, never)
        with (
            enter(config, "r1") as late,
            pytest.raises(BusError, match="a team that walks already, expected a network without"),
        ):
            join(late, config, never)


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_an_agent_and_an_operator_join_a_team_that_walks(
    mode: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """But in lock-step no agent does."""
    config = team(**{"world.mode": mode})
    buses = {name: enter(config, name) for name in ("sim", "r1", "operator")}
    meet_all(config, *buses.values())
    for name in ("r1", "operator"):
        buses[name].declare(READY)
    assert start_together(buses["sim"], config, never)
    with (
        enter(config, "r1") as double,
        pytest.raises(BusError, match=r"walks already|two processes"),
    ):
        join(double, config, never, rejoins=True)
    for name in ("r1", "operator"):
        buses[name].close()
        with enter(config, name) as again:
            if (name, mode) == ("r1", "lockstep"):
                with pytest.raises(BusError, match="no agent can be started again"):
                    join(again, config, never, rejoins=True)
            else:
                assert join(again, config, never, rejoins=True) == REJOINS
                said = f"quadriga: {name} joins team 'team', which walks"
                assert said in capsys.readouterr().err
    buses["sim"].close()


def test_who_is_started_with_its_team_starts() -> None:
    config, found = team(), dict[str, str]()
    buses = [enter(config, name) for name in ("sim", "r1", "operator")]

    def start(bus: Bus) -> None:
        found[bus.name] = join(bus, config, never, rejoins=True)

    threads = [Thread(target=start, args=(bus,)) for bus in buses]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == dict.fromkeys(("sim", "r1", "operator"), STARTS)
    for bus in reversed(buses):
        bus.close()


@pytest.mark.parametrize("again", ["plant_r2", "r2"])
def test_a_robot_that_is_started_again_does_not_join_a_team_that_walks(again: str) -> None:
    """Its bridge, or its agent, even where the one before is gone already."""
    each = {
        "team.robots": 2,
        "team.plant_per_robot": True,
        "team.yokes": "none",
        "planner.kind": "none",
    }
    config = team(**each)
    names = sorted(members(config), key=lambda name: name != "plant_r1")
    buses = {name: enter(config, name) for name in names}
    meet_all(config, *buses.values())
    for name, bus in buses.items():
        if name != "plant_r1":
            bus.declare(READY)
    assert start_together(buses["plant_r1"], config, never)
    buses[again].close()
    with (
        enter(config, again) as late,
        pytest.raises(BusError, match="a team that walks already, expected a network without"),
    ):
        join(late, config, never)
    for bus in reversed(buses.values()):
        bus.close()


def test_a_team_does_not_start_with_two_of_one_name() -> None:
    config = team()
    with (
        enter(config, "sim") as sim,
        enter(config, "r1") as r1,
        enter(config, "operator") as operator,
        enter(config, "r1") as double,
    ):
        meet_all(config, sim, r1, operator)
        for bus in (r1, operator, double):
            bus.declare(READY)
        double.declare("here")
        double.wait_for("here", {"sim", "operator"}, 10.0, never)
        sim.wait_for(READY, {"r1", "operator"}, 10.0, never)
        deadline = 100
        while not sim.duplicates("here") and deadline:
            sim.get(0.05)
            deadline -= 1
        with pytest.raises(BusError, match=r"two processes named r1, expected one of each name"):
            start_together(sim, config, never)


def test_the_sim_server_names_who_is_not_ready() -> None:
    config = team(**{"bus.barrier_timeout": 1.0})
    with (
        enter(config, "sim") as sim,
        enter(config, "r1") as r1,
        enter(config, "operator") as operator,
    ):
        meet_all(config, sim, r1, operator)
        operator.declare(READY)
        with pytest.raises(BusError, match="no r1 at stage 'ready'"):
            start_together(sim, config, never)
