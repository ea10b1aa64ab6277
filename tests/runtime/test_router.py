"""A team's router: who waits for it, when it leaves, and that two of them are linked."""

from __future__ import annotations

import signal
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

import pytest

from quadriga.commands.parser import build_parser
from quadriga.shared.bus.session import READY, Bus
from quadriga.shared.bus.settings import link_settings
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.clock import monotonic
from quadriga.team.endpoint import free_endpoint
from quadriga.team.router import run
from tests.listening import WAIT
from tests.runtime.conftest import Make, router, run_command

PLANS = ("team/r1/plan", "team/r2/plan")


def test_a_router_stays_until_it_is_told_to_leave(make_team: Make) -> None:
    team = make_team(bus__mode="client", world__duration=0.5)
    with router(team.config.bus.endpoint) as process:
        with team.launch() as running:
            running.watch(lambda: False)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT) == 0


def test_a_router_for_one_walk_does_not_wait_for_ever() -> None:
    options = ("--once", "--set", "bus.barrier_timeout=0.1")
    with router(free_endpoint(), *options, says="") as process:
        _, errors = process.communicate(timeout=WAIT)
    assert process.returncode == 2
    assert "barrier of team 'team', seen by router: got no sim at stage 'ready'" in errors


def test_a_port_that_is_taken() -> None:
    endpoint = free_endpoint()
    with Bus.route(endpoint, "other"), router(endpoint, says="") as process:
        _, errors = process.communicate(timeout=WAIT)
    assert process.returncode == 2
    assert "another team or program listens there" in errors
    assert errors.count("\n") == 1


@pytest.mark.parametrize("name", ["sim", "operate"])
def test_nobody_waits_for_a_router_for_ever(make_team: Make, name: str) -> None:
    team = make_team(bus__mode="client", bus__barrier_timeout=0.3)
    status, errors = run_command(name, "--config", team.file)
    assert status == 2
    waits, error = errors.splitlines()
    assert waits.endswith(f"waits for a router at {team.config.bus.endpoint}")
    assert "no router there" in error


def test_waiting_for_a_router_can_be_interrupted(make_team: Make) -> None:
    asked: list[float] = []

    def stopped() -> bool:
        asked.append(monotonic())
        return len(asked) == 3

    with pytest.raises(KeyboardInterrupt):
        Bus.open(make_team(bus__mode="client").config.bus, "team", "sim", stopped)
    assert asked[-1] - asked[0] < 5.0


def say_until_heard(put: Callable[[bytes], None], hearer: Bus) -> tuple[str, bytes] | None:
    """What is heard first; who listens becomes known to the other router in its own time."""
    deadline = monotonic() + WAIT
    while (packet := hearer.get(0.1)) is None and monotonic() < deadline:
        put(b"plan")
    return packet


@pytest.mark.parametrize("later", [False, True], ids=["it is there", "it comes later"])
def test_plans_of_agents_at_two_linked_routers_cross(later: bool) -> None:
    ends = free_endpoint(), free_endpoint()
    first, second = (BusConfig(mode="client", endpoint=end) for end in ends)
    routers = [(ends[0],), (ends[1], "--link", ends[0])]
    with ExitStack() as stack:
        for words in routers[::-1] if later else routers:
            stack.enter_context(router(*words))
        r1 = stack.enter_context(Bus.open(first, "team", "r1"))
        r2 = stack.enter_context(Bus.open(second, "team", "r2"))
        r1.subscribe(PLANS[1])
        r2.subscribe(PLANS[0])
        for bus in (r1, r2):
            bus.declare(READY)
        assert r1.wait_for(READY, ["r2"], WAIT, lambda: False)
        assert r2.wait_for(READY, ["r1"], WAIT, lambda: False)
        assert say_until_heard(r1.publisher(PLANS[0]), r2) == (PLANS[0], b"plan")
        assert say_until_heard(r2.publisher(PLANS[1]), r1) == (PLANS[1], b"plan")


def test_a_link_that_is_open_to_others_is_refused_unless_that_is_accepted() -> None:
    listen, link = "tcp/127.0.0.1:1", "tcp/192.168.1.10:7447"
    for ends in (("tls/127.0.0.1:1", "tls/127.0.0.1:2"), (listen, "tls/127.0.0.1:2")):
        with pytest.raises(ConfigError, match=r"--link: got 'tls/.*one router for all"):
            link_settings(BusConfig(), ends[0], [ends[1]])
    with pytest.raises(ConfigError, match="--link: got"):
        link_settings(BusConfig(), listen, [link])
    accepted = link_settings(replace(BusConfig(), plaintext=True), listen, [link])
    assert accepted["connect/endpoints"] == [link]
    given = build_parser().parse_args(["router", "--link", "tcp/a:1", "--link", "tcp/b:1"])
    assert given.link == ["tcp/a:1", "tcp/b:1"]


def test_linked_routers_do_not_wait_for_each_other_to_leave() -> None:
    with pytest.raises(ConfigError, match="--once: got with --link"):
        run(Config(), free_endpoint(), once=True, links=[free_endpoint()])
