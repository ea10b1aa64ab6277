"""An emulated network: real packets between namespaces, and nothing left of it afterwards."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from quadriga.faults.catalogue import BY_NAME
from quadriga.faults.fault import FaultScene
from quadriga.faults.network.emulated import EmulatedNetwork
from quadriga.faults.network.layout import TEAM, NetworkLayout
from quadriga.faults.network.link import LinkFaults
from quadriga.faults.network.order import RadioOrder
from quadriga.faults.trial import draw_fault
from quadriga.shared.config.load import load
from quadriga.shared.errors import ProcessError
from quadriga.shared.members import OPERATOR
from quadriga.team.launch import Launch, process_table
from tests.listening import await_true

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(os.geteuid() != 0, reason="namespaces need root"),
]

# Sends datagrams, one after the other, to one that sends them back; prints the milliseconds that
# each took, −1 if it did not come back in time.
_PING = """
import socket, sys, time
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.settimeout(float(sys.argv[3]))
for number in range(int(sys.argv[2])):
    begun = time.monotonic()
    link.sendto(b"%d" % number, (sys.argv[1], 5005))
    try:
        while link.recv(100) != b"%d" % number: pass
        print(1e3 * (time.monotonic() - begun))
    except TimeoutError:
        print(-1)
"""
_ECHO = """
import socket, sys
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind((sys.argv[1], 5005))
print("ready", flush=True)
while True:
    link.sendto(*link.recvfrom(100))
"""

_MAKER = """
import sys
from pathlib import Path
from quadriga.faults.network.emulated import EmulatedNetwork
from quadriga.faults.network.layout import NetworkLayout
layout = NetworkLayout(int(sys.argv[1]), ("r1",), True)
network = EmulatedNetwork(layout, 1, Path(sys.argv[2]))
print(network._air.pid, flush=True)
input()
"""


def ping(enter: Sequence[str], address: str, number: int = 5, wait: float = 5.0) -> list[float]:
    """Milliseconds until datagrams are back from an address."""
    command = [*enter, sys.executable, "-c", _PING, address, str(number), str(wait)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=30)
    return [float(line) for line in done.stdout.split()]


@contextmanager
def echoing(enter: Sequence[str], address: str) -> Iterator[None]:
    command = [*enter, sys.executable, "-c", _ECHO, address]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as echo:
        assert echo.stdout is not None
        assert echo.stdout.readline() == b"ready\n"
        yield
        echo.kill()


@pytest.fixture(name="network", params=[False, True], ids=["air", "cables"])
def _network(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[EmulatedNetwork]:
    layout = NetworkLayout(os.getpid() % 512, ("r1", "r2"), bool(request.param))
    with (
        EmulatedNetwork(layout, 1, tmp_path / "air.log") as network,
        echoing(network.enter("r2"), layout.address("r2")),
    ):
        yield network
    assert not devices_of(layout)


def devices_of(layout: NetworkLayout) -> list[str]:
    own = (layout.air(TEAM), *map(layout.cable, layout.robots))
    return [name for name in os.listdir("/sys/class/net") if name in own]


def test_a_faulty_radio_and_a_cable_that_does_not_care(network: EmulatedNetwork) -> None:
    wired, r1, r2 = network.layout.wired, network.enter("r1"), network.layout.address("r2")
    assert min(ping(r1, r2)) > 0.0
    network.order(RadioOrder("r2", LinkFaults(delay=30.0)))
    assert min(ping(r1, r2)) >= 60.0
    network.order(RadioOrder("r2", LinkFaults(loss=1.0)))
    assert set(ping(r1, r2, 3, 0.1)) == {-1.0}
    if wired:
        assert min(ping(network.enter(TEAM), r2)) > 0.0
    else:
        assert set(ping(network.enter(TEAM), r2, 3, 0.1)) == {-1.0}


def test_a_second_network_of_the_same_number_is_refused_with_the_reason(
    network: EmulatedNetwork, tmp_path: Path
) -> None:
    with pytest.raises(ProcessError, match="emulated network: got"):
        EmulatedNetwork(network.layout, 1, tmp_path / "second.log")
    assert min(ping(network.enter("r1"), network.layout.address("r2"))) > 0.0


@pytest.mark.parametrize("name", ["link-partition", "radio-partition"])
def test_a_partition_cuts_off_the_agent_that_the_seed_draws(name: str, tmp_path: Path) -> None:
    config = load(None, {"team.robots": 2})
    draw = draw_fault(config, 7)
    with BY_NAME[name].stage(config, draw, tmp_path) as stage:
        rows = {row.name: stage.wrap(row) for row in process_table(config, tmp_path, None, "")}
        enter = {name: row.command[:3] for name, row in rows.items() if row.command[0] == "nsenter"}
        assert enter.keys() == {"r1", "r2"} | ({OPERATOR} if name.startswith("radio") else set())
        address = rows[draw.robot].command[-1].partition("tcp/")[2].partition(":")[0]
        other = next(there for there in ("r1", "r2") if there != draw.robot)
        with echoing(enter[draw.robot], address):
            assert min(ping(enter[other], address)) > 0.0
            assert stage.strike is not None
            with Launch([], tmp_path) as launch:
                stage.strike(FaultScene(stage.config, draw, tmp_path, launch))
            assert set(ping(enter[other], address, 3, 0.1)) == {-1.0}


def test_nothing_is_left_when_who_made_it_is_killed(tmp_path: Path) -> None:
    number = (os.getpid() + 1) % 512
    layout = NetworkLayout(number, ("r1",), wired=True)
    command = [sys.executable, "-c", _MAKER, str(number), str(tmp_path / "log")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as made:
        assert made.stdout is not None
        air = int(made.stdout.readline())
        assert set(devices_of(layout)) == {layout.air(TEAM), layout.cable("r1")}
        made.send_signal(signal.SIGKILL)
    await_true(lambda: not devices_of(layout) and not Path(f"/proc/{air}").exists())


def test_nothing_is_left_when_the_air_is_killed(tmp_path: Path) -> None:
    layout = NetworkLayout((os.getpid() + 2) % 512, ("r1",), wired=True)
    with EmulatedNetwork(layout, 1, tmp_path / "log") as network:
        network._air.kill()
        network._air.wait()
        await_true(lambda: not devices_of(layout))
        with pytest.raises(ProcessError, match="the emulated network"):
            network.order(RadioOrder("r1", LinkFaults()))
