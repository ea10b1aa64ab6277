"""What is urgent gets through a router although somebody behind it takes nothing any more."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint

WAIT = 10.0  # s, far more than anything here takes
SOON = 1.0  # s; who is held up waits for the frozen process's link to end, 4 s and more
PACE = 0.002  # s, at which the router keeps up
CHUNK, CHUNKS = bytes(50_000), 400  # more than all that waits between a router and who is frozen

ROUTER = """
import sys
from quadriga.shared.bus.session import Bus
with Bus.route(sys.argv[1], "team"):
    print(flush=True)
    input()
"""
RECORDER = """
import sys
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import BusConfig
with Bus.open(BusConfig(endpoint=sys.argv[1], mode="client"), "team", "recorder") as bus:
    bus.subscribe("team/**")
    bus.declare(HERE)
    print(flush=True)
    input()
"""


@contextmanager
def process(program: str, endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process that has said that it is there."""
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", program, endpoint]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe) as running:
        try:
            assert running.stdout is not None
            assert running.stdout.readline() == b"\n"
            yield running
        finally:
            running.kill()


@pytest.fixture
def congested() -> Iterator[tuple[Bus, Bus]]:
    """Two processes at a router whose link to a recorder that stands still is full."""
    endpoint = free_endpoint()
    config = BusConfig(mode="client", endpoint=endpoint)
    with process(ROUTER, endpoint), process(RECORDER, endpoint) as recorder, ExitStack() as stack:
        names = ("sim", "r1", "operator")
        sim, r1, operator = (stack.enter_context(Bus.open(config, "team", n)) for n in names)
        r1.subscribe("team/operator/*")
        r1.declare(HERE)
        for bus in (sim, operator):
            assert bus.wait_for(HERE, {"recorder", "r1"}, WAIT, lambda: False)
        recorder.send_signal(signal.SIGSTOP)
        put = sim.publisher("team/sim/x", waits=False)
        for _ in range(CHUNKS):
            put(CHUNK)
            sleep(PACE)
        yield operator, r1
        recorder.kill()  # else nobody could leave


def longest_way(r1: Bus, put: Callable[[bytes], None]) -> float:
    """Of ten messages, one after another, s."""
    longest = 0.0
    for _ in range(10):
        begun = monotonic()
        put(b"")
        assert r1.get(WAIT) is not None
        longest = max(longest, monotonic() - begun)
    return longest


def test_what_waits_for_nobody_arrives_though_a_link_is_full(congested: tuple[Bus, Bus]) -> None:
    (operator, r1), key = congested, "team/operator/x"
    assert longest_way(r1, operator.publisher(key, urgent=True)) < SOON
    assert longest_way(r1, operator.publisher(key, waits=False)) < SOON
    # What waits for everybody is held up: the link is full indeed.
    assert longest_way(r1, operator.publisher(key)) > SOON
