"""`quadriga echo` on a live bus, as processes of their own that nobody waits for."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import BusConfig, Config, TeamConfig
from quadriga.shared.members import SIM
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT
from tests.shared.recording.test_reader import state


@pytest.fixture
def config() -> Config:
    return Config(team=TeamConfig(name="band"), bus=BusConfig(endpoint=free_endpoint()))


@pytest.fixture
def world(config: Config) -> Iterator[Bus]:
    with Bus.open(config.bus, "band", SIM) as bus:
        bus.declare(HERE)
        yield bus


def listen(config: Config, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [
            sys.executable,
            "-m",
            "quadriga",
            *words,
            "--team",
            "band",
            "--endpoint",
            config.bus.endpoint,
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def talk(world: Bus, listener: subprocess.Popen[str]) -> tuple[str, str]:
    """Publish at up to 500 Hz until the listener has heard enough: what it said."""
    puts = [world.publisher(f"band/{key}") for key in ("r1/state", "r2/state", "r1/new")]
    deadline, tick = monotonic() + WAIT, 0
    while listener.poll() is None:
        assert monotonic() < deadline
        for put in puts:
            if tick % 5 != 3:
                put(encode(state(tick)))
        tick += 1
        sleep(0.002)
    return listener.communicate()


def test_echo_hears_the_bus(config: Config, world: Bus) -> None:
    listener = listen(config, "echo", "r1/state", "r1/new", "-n", "6")
    out, err = talk(world, listener)
    lines = out.splitlines()
    assert (listener.returncode, err, len(lines)) == (0, "", 6)
    assert {line.split()[2] for line in lines} == {"band/r1/state", "band/r1/new"}
    assert world.members_at(HERE) == frozenset()  # it has never said that it is a member


def test_rates_count_what_comes_and_what_does_not(config: Config, world: Bus) -> None:
    listener = listen(config, "echo", "--rates", "r1/state", "-n", "2", "--every", "0.7")
    out, err = talk(world, listener)
    assert (listener.returncode, err) == (0, "")
    tables = out.strip().split("\n\n")
    assert len(tables) == 2
    row = re.split(r"  +", tables[1].splitlines()[1])
    assert row[0] == "band/r1/state"
    assert 600 < float(row[2]) < 1000  # 4 of 5, by world time
    assert row[3] == "1 – 2"
    assert float(row[4]) > 0.0  # by the clock of a busy machine
    assert int(row[6]) >= int(row[1]) // 5


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_listener_to_nobody_says_so_and_leaves_when_told(
    config: Config, number: signal.Signals
) -> None:
    listener = listen(config, "echo", "state")
    assert listener.stderr is not None
    line = listener.stderr.readline()
    assert "nothing yet of state of team 'band'" in line
    assert "linked to nobody" in line
    listener.send_signal(number)
    out, _ = listener.communicate(timeout=WAIT)
    assert (listener.returncode, out) == (0, "")


def test_a_closed_pipe_ends_it_quietly(config: Config, world: Bus) -> None:
    listener = listen(config, "echo", "r1/state")
    assert listener.stdout is not None
    listener.stdout.close()
    listener.stdout = None
    _, err = talk(world, listener)
    assert (listener.returncode, err) == (0, "")
