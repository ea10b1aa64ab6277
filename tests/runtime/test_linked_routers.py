"""Two linked routers: who is at one hears who is at the other, in whatever order they come."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
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
from tests.runtime.conftest import WAIT

PLANS = ("team/r1/plan", "team/r2/plan")


@contextmanager
def router(listen: str, *options: str) -> Iterator[subprocess.Popen[str]]:
    """The process of a router."""
    command = [sys.executable, "-m", "quadriga", "router", "--listen", listen, *options]
    command += ["--parent", str(os.getpid())]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr
            assert "routing at" in process.stderr.readline()
            yield process
        finally:
            process.kill()


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


@pytest.mark.parametrize(
    ("listen", "link"),
    [("tls/127.0.0.1:1", "tls/127.0.0.1:2"), ("tcp/127.0.0.1:1", "tls/127.0.0.1:2")],
)
def test_routers_with_certificates_are_not_linked(listen: str, link: str) -> None:
    with pytest.raises(ConfigError, match=r"--link: got 'tls/.*one router for all"):
        link_settings(BusConfig(), listen, [link])


def test_a_link_that_is_open_to_others_is_refused_unless_that_is_accepted() -> None:
    bus, link = BusConfig(), "tcp/192.168.1.10:7447"
    with pytest.raises(ConfigError, match="--link: got"):
        link_settings(bus, "tcp/127.0.0.1:1", [link])
    accepted = link_settings(replace(bus, plaintext=True), "tcp/127.0.0.1:1", [link])
    assert accepted["connect/endpoints"] == [link]


def test_links_are_given_one_by_one() -> None:
    given = build_parser().parse_args(["router", "--link", "tcp/a:1", "--link", "tcp/b:1"])
    assert given.link == ["tcp/a:1", "tcp/b:1"]


def test_linked_routers_do_not_wait_for_each_other_to_leave() -> None:
    with pytest.raises(ConfigError, match="--once: got with --link"):
        run(Config(), free_endpoint(), once=True, links=[free_endpoint()])
