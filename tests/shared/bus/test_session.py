"""Real Zenoh over loopback: links, order, presence, leaving, and the errors of a network."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import pytest
import zenoh

from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep
from quadriga.team.endpoint import free_endpoint

WAIT = 10.0  # s, far more than anything here takes
GRACE = 5.0  # s, that the launcher gives a process to leave
PYTHON = (sys.executable, "-c")
Open = Callable[..., Bus]


def never() -> bool:
    return False


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def opened(endpoint: str) -> Iterator[Open]:
    """A function that opens a bus, by name, on the test's own endpoint; all are closed at last."""
    with ExitStack() as stack:

        def open_bus(name: str, team: str = "team", mode: str = "peer") -> Bus:
            config = BusConfig(mode=mode, endpoint=endpoint, plaintext=True)
            return stack.enter_context(Bus.open(config, team, name))

        yield open_bus


def meet(*buses: Bus) -> None:
    """Everyone here and seen by everyone."""
    for bus in buses:
        bus.declare(HERE)
    for bus in buses:
        assert bus.wait_for(HERE, {other.name for other in buses}, WAIT, never)


def wait_until(condition: Callable[[], object]) -> None:
    deadline = monotonic() + WAIT
    while not condition():
        assert monotonic() < deadline
        sleep(0.005)


def numbers(bus: Bus, count: int) -> list[int]:
    """The next `count` payloads as numbers."""
    packets = [bus.get(WAIT) for _ in range(count)]
    return [int(packet[1]) for packet in packets if packet]


def test_everyone_reaches_everyone_though_all_know_only_the_sim_server(opened: Open) -> None:
    r1, r2 = opened("r1"), opened("r2")  # before the sim server
    sim = opened("sim")
    for bus in (sim, r1, r2):
        bus.subscribe("team/*/x")
    meet(sim, r1, r2)
    put = r1.publisher("team/r1/x")
    for k in range(200):
        put(b"%d" % k)
    assert numbers(r2, 200) == numbers(sim, 200) == list(range(200))
    begun = monotonic()
    assert r1.get(0.05) is None  # nobody hears himself
    assert 0.04 < monotonic() - begun < 1.0
    r2.publisher("team/r2/x", waits=False)(b"\x00\xff")
    assert sim.get(WAIT) == ("team/r2/x", b"\x00\xff")
    assert sim.drain() == []


def test_what_is_collected_is_apart_from_the_inbox_and_has_the_time_it_arrived(
    opened: Open,
) -> None:
    sim, r1 = opened("sim"), opened("r1")
    collected, put = r1.collect("team/clock"), sim.publisher("team/clock")
    r1.subscribe("team/other")
    other = sim.publisher("team/other")
    meet(sim, r1)
    sent = monotonic_ns()
    for number in range(3):
        put(b"%d" % number)
    other(b"9")
    assert numbers(r1, 1) == [9]
    arrivals, looked = collected(), monotonic_ns()
    assert [arrival[1:] for arrival in arrivals] == [
        ("team/clock", b"%d" % number) for number in range(3)
    ]
    times = [at for at, _, _ in arrivals]
    assert [sent, *times, looked] == sorted([sent, *times, looked])
    assert collected() == []


def test_the_newest_message_is_kept_and_given_once_and_the_inbox_has_none(opened: Open) -> None:
    sim, looker = opened("sim"), opened("view-1")
    newest, heard = looker.keep_newest("team/clock"), list[bytes]()
    looker.hear("team/clock", heard.append)
    meet(sim, looker)
    put, seen = sim.publisher("team/clock"), list[bytes]()
    for k in range(1000):
        put(b"%d" % k)

    def is_last() -> bool:
        kept = newest()
        seen.extend([] if kept is None else [kept])
        return seen[-1:] == [b"999"]

    wait_until(is_last)
    assert seen == sorted({*seen}, key=int)
    for k in range(3):
        put(b"%d" % k)
    wait_until(lambda: len(heard) == 1003)
    assert heard[-4:] == [b"999", b"0", b"1", b"2"], "who hears it misses none"
    assert [newest(), newest()] == [b"2", None]
    assert looker.get(0.0) is None


def test_what_was_sent_before_closing_arrives(opened: Open) -> None:
    sim, r1 = opened("sim"), opened("r1")
    sim.subscribe("team/**")
    meet(sim, r1)
    put = r1.publisher("team/r1/x")
    for k in range(5000):
        put(b"%d" % k)
    r1.close()
    assert numbers(sim, 5000) == list(range(5000))


IMPORTS = """
import os, sys, time
from pathlib import Path
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import BusConfig
"""
FROZEN = """
with Bus.open(BusConfig(endpoint=sys.argv[1]), "team", "r1") as bus:
    bus.subscribe("team/**")
    bus.declare(HERE)
    while True:
        bus.get(1.0)
"""
LEAVES = """
with Bus.open(BusConfig(endpoint=sys.argv[1]), "team", "sim") as bus:
    bus.declare(HERE)
    bus.wait_for(HERE, {"r1", "r2"}, 10.0, lambda: False)
    print(flush=True)
    input()
    put = bus.publisher("team/sim/x")
    for k in range(2000):
        put(b"%500d" % k)
"""


def test_who_is_frozen_keeps_nobody_from_leaving(opened: Open, endpoint: str) -> None:
    """Zenoh fails to close a session from which a frozen process has yet to read this much."""
    r2 = opened("r2")
    r2.subscribe("team/**")
    r2.declare(HERE)
    pipe = subprocess.PIPE
    with (
        subprocess.Popen(
            [*PYTHON, IMPORTS + LEAVES, endpoint], stdin=pipe, stdout=pipe, stderr=pipe
        ) as sim,
        subprocess.Popen([*PYTHON, IMPORTS + FROZEN, endpoint]) as r1,
    ):
        try:
            assert sim.stdout is not None
            assert sim.stdout.readline() == b"\n"
            r1.send_signal(signal.SIGSTOP)
            outputs = sim.communicate(b"\n", WAIT)
        finally:
            r1.kill()
            sim.kill()
    assert (sim.returncode, *outputs) == (0, b"", b"")
    assert numbers(r2, 2000) == list(range(2000))


def test_who_shakes_no_hands_keeps_nobody_from_leaving(opened: Open, endpoint: str) -> None:
    """Zenoh tries to shake hands for ten seconds, and until then closes no session."""

    def leaves_in_time(bus: Bus) -> bool:
        begun = monotonic()
        bus.close()
        return monotonic() - begun < GRACE

    with socket.create_server(("127.0.0.1", 0)) as mute:
        config = BusConfig(endpoint=f"tcp/127.0.0.1:{mute.getsockname()[1]}")
        r1 = Bus.open(config, "team", "r1")
        with mute.accept()[0]:
            assert leaves_in_time(r1)
    sim, (host, port) = opened("sim"), endpoint.removeprefix("tcp/").split(":")
    with socket.create_connection((host, int(port))):
        meet(sim, opened("r1"))  # who calls later is heard later
        assert leaves_in_time(sim)


def test_presence_comes_and_goes_by_stage(opened: Open) -> None:
    sim, r1 = opened("sim"), opened("r1")
    meet(sim, r1)
    assert sim.members_at(READY) == frozenset()
    r1.declare(READY)
    assert sim.wait_for(READY, {"r1"}, WAIT, never)
    assert sim.members_at(HERE) == {"r1"}
    r1.close()
    wait_until(lambda: not sim.members_at(HERE) | sim.members_at(READY))


def test_who_is_absent_and_two_of_one_name_are_noticed(opened: Open) -> None:
    sim, first, second = opened("sim"), opened("r1"), opened("r1")
    first.declare(HERE)
    assert not sim.wait_for(HERE, {"r1", "r2"}, 0.2, never)
    assert not sim.wait_for(HERE, {"r2"}, WAIT, lambda: True)
    assert sim.duplicates(HERE) == frozenset()
    second.declare(HERE)
    wait_until(lambda: sim.duplicates(HERE) == first.duplicates(HERE) == {"r1"})


def test_who_joins_is_found_without_a_sim_server_and_steps_back_for_one_who_listens(
    opened: Open, endpoint: str
) -> None:
    config = BusConfig(endpoint=endpoint)
    early = opened("r1")
    with Bus.join(config, "team", "first") as first, Bus.join(config, "team", "second") as second:
        early.subscribe("team/*/x")
        meet(early, first, second)
        second.publisher("team/r2/x")(b"7")
        assert numbers(early, 1) == [7]
        with pytest.raises(BusError, match=rf"{endpoint}.*Address already in use.*another team"):
            opened("sim")
    with pytest.raises(BusError, match="no router there"):
        Bus.join(BusConfig(mode="client", endpoint=endpoint), "team", "third")


@pytest.mark.parametrize(
    ("name", "keys", "error"),
    [
        ("sim", {"endpoint": "tcp/203.0.113.1:7447"}, r"bus\.endpoint .*no interface of this"),
        ("sim", {"endpoint": ""}, r"bus\.endpoint .*not of the form tcp/HOST:PORT"),
        ("r1", {"endpoint": "carrier-pigeon/roof:1"}, r"bus\.endpoint 'carrier-pigeon/roof:1' of"),
        ("r1", {"listen": "tcp/203.0.113.1:0"}, r"bus\.listen .* of r1: .*no interface of this"),
        ("r1", {"listen": "tcp/no host:0"}, r"bus\.listen .* of r1: .*does not resolve"),
        ("r1", {"listen": "carrier-pigeon/roof:1"}, r"bus\.listen .* of r1: .*not of the form"),
    ],
)
def test_an_endpoint_that_cannot_be_opened(
    endpoint: str, name: str, keys: dict[str, Any], error: str
) -> None:
    with pytest.raises(BusError, match=f"^{error}"):
        Bus.open(replace(BusConfig(endpoint=endpoint, plaintext=True), **keys), "team", name)


def test_nobody_is_reached_from_other_machines_unasked() -> None:
    for key, config in (
        ("endpoint", BusConfig(endpoint="tcp/203.0.113.1:1")),
        ("listen", BusConfig(listen="tcp/0.0.0.0:0")),
    ):
        with pytest.raises(ConfigError, match=rf"bus\.{key}: got .*bus\.plaintext = true"):
            Bus.open(config, "team", "r1")
    with pytest.raises(ConfigError, match="--listen: got"):
        Bus.route("tcp/0.0.0.0:7447", "team")


def test_who_waits_for_a_router_says_so_once(
    endpoint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    looks = iter([False, False, False, True])
    config = BusConfig(mode="client", endpoint=endpoint)
    with pytest.raises(BusError, match="no router there"):
        Bus.open(config, "team", "r1")
    with pytest.raises(KeyboardInterrupt):
        Bus.open(config, "team", "r1", lambda: next(looks))
    assert capsys.readouterr().err == f"quadriga: r1 waits for a router at {endpoint}\n"


def test_two_teams_at_one_router_do_not_mix(opened: Open, endpoint: str) -> None:
    with Bus.route(endpoint, "a"):
        teams = []
        for team in ("a", "b"):
            sim, r1 = (opened(name, team=team, mode="client") for name in ("sim", "r1"))
            sim.subscribe(f"{team}/**")
            teams.append((team, sim, r1))
        for team, sim, r1 in teams:
            meet(sim, r1)
            r1.publisher(f"{team}/r1/x")(team.encode())
        for team, sim, _ in teams:
            assert sim.get(WAIT) == (f"{team}/r1/x", team.encode())
            assert sim.get(0.1) is None
            assert sim.members_at(HERE) == {"r1"}
            assert not sim.duplicates(HERE)
        for _, sim, r1 in teams:
            r1.close()
            sim.close()


def test_a_stock_client_finds_no_process_of_a_team(endpoint: str) -> None:
    """Who looks around in the network must be told where to go."""

    def found() -> set[str]:
        scout = zenoh.scout(what="peer|router")
        sleep(1.0)
        return {str(hello.zid) for hello in iter(scout.try_recv, None)}

    stock = zenoh.Config()
    stock.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    with zenoh.open(stock) as other:
        if str(other.zid()) not in found():
            pytest.skip("no multicast on this machine: not even a stock process is found")
    before = found()
    with Bus.open(BusConfig(endpoint=endpoint), "team", "sim"):
        assert not found() - before


THREADS = """
endpoint, who, wanted = sys.argv[1:]
config = BusConfig(endpoint=endpoint)
with Bus.route(endpoint, "team") if who == "router" else Bus.open(config, "team", who) as opened:
    opened.declare(HERE)
    opened.wait_for(HERE, {"r1"}, 20.0, lambda: False)
    # Those that receive begin with the first link. Zenoh names a thread rx-0 once it has run.
    time.sleep(1.0)
    deadline, found = time.monotonic() + 20.0, -1
    while found != int(wanted) and time.monotonic() < deadline:
        time.sleep(0.05)
        names = [task.read_text() for task in Path("/proc/self/task").glob("*/comm")]
        found = sum(name.startswith("rx-") for name in names)
    print(found, os.environ.get("ZENOH_RUNTIME"))
"""


@pytest.mark.parametrize(
    ("who", "given", "threads"),
    [("sim", None, 1), ("router", None, 2), ("sim", "(rx: (worker_threads: 3))", 3)],
)
def test_a_member_receives_in_one_thread_unless_the_user_has_chosen(
    endpoint: str, who: str, given: str | None, threads: int
) -> None:
    environment = {name: text for name, text in os.environ.items() if name != "ZENOH_RUNTIME"}
    environment |= {} if given is None else {"ZENOH_RUNTIME": given}
    command = [*PYTHON, IMPORTS + THREADS, endpoint, who, str(threads)]
    config = BusConfig(endpoint=endpoint, mode="client" if who == "router" else "peer")
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process,
        Bus.open(config, "team", "r1", never) as other,
    ):
        other.declare(HERE)
        said, _ = process.communicate(timeout=60.0)
    assert said == f"{threads} {given}\n"
