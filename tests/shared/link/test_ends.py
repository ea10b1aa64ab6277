"""The two ends of a plant link: sockets and Zenoh sessions as they are, processes that end."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.link import connections, packets
from quadriga.shared.link.agent_end import AgentEnd
from quadriga.shared.link.connections import CLOSED, NOTHING, local_address
from quadriga.shared.link.plant_end import PlantEnd
from quadriga.shared.messages import State
from quadriga.shared.runtime.clock import monotonic
from quadriga.team.endpoint import free_endpoint
from tests.listening import await_true

ROW = np.arange(packets.STATE_SIZE, dtype=float)
ANSWER = np.arange(packets.COMMAND_SIZE, dtype=float)
PYTHON = (sys.executable, "-c")
AGENT = """
import sys
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.load import load
from quadriga.shared.link.agent_end import AgentEnd
config = load(None, {"bus.endpoint": sys.argv[1], "plant.link": sys.argv[2]})
with Bus.open(config.bus, "team", "r1") as bus:
    link = AgentEnd(config, "r1", bus)
    bus.declare(HERE)
    bus.wait_for(HERE, {"sim"}, 20.0, lambda: False)
    link.open(lambda: False)
    print("open", flush=True)
    sys.stdin.read()
"""


class Team:
    """A plant and agents in this process, each with a session of its own."""

    def __init__(self, link: str, **keys: Any) -> None:
        given = {"bus.endpoint": free_endpoint(), "plant.link": link, "team.robots": 2}
        self.config: Config = load(None, given | keys)
        self.stack = ExitStack()
        self.bus = self.open_bus("sim")
        self.plant = self.stack.enter_context(
            closing(PlantEnd(self.config, ("r1", "r2"), self.bus))
        )
        self.plant.open()
        self.bus.declare(HERE)

    def open_bus(self, name: str) -> Bus:
        return self.stack.enter_context(Bus.open(self.config.bus, "team", name))

    def agent(self, robot: str = "r1", config: Config | None = None) -> AgentEnd:
        """An agent's end that has met the plant."""
        bus = self.open_bus(robot)
        end = self.stack.enter_context(closing(AgentEnd(config or self.config, robot, bus)))
        bus.declare(HERE)
        assert bus.wait_for(HERE, {"sim"}, 20.0, lambda: False)
        assert self.bus.wait_for(HERE, {robot}, 20.0, lambda: False)
        return end

    def open_agent(self, robot: str = "r1") -> AgentEnd:
        end = self.agent(robot)
        assert end.open(lambda: False)
        return end


@pytest.fixture(params=["local", "bus"])
def team(request: pytest.FixtureRequest) -> Iterator[Team]:
    made = Team(request.param)
    with made.stack:
        yield made


def await_state(end: AgentEnd) -> None:
    deadline = monotonic() + 20.0
    while not end.receive(wait=True):
        assert monotonic() < deadline


def test_states_go_one_way_and_commands_the_other(team: Team) -> None:
    first, second = team.open_agent("r1"), team.open_agent("r2")
    for tick in (7, 1 << 41):
        for name, end, share in (("r1", first, 1.0), ("r2", second, 2.0)):
            team.plant.send(name, State.from_row(tick, 10**6 * tick, share * ROW))
            await_state(end)
            assert (end.received.tick, end.received.stamp_ns) == (tick, 10**6 * tick)
            assert end.received.state.tobytes() == (share * ROW).tobytes()
            end.command.row[:] = share * ANSWER
            end.send(end.command.stamp(tick, 10**6 * tick))
            assert team.plant.receive(name, wait=True) > 0
            assert not team.plant.received.parse(packets.HEADER.size + 8 * packets.COMMAND_SIZE)
            assert team.plant.received.tick == tick
            assert team.plant.received.command.tobytes() == (share * ANSWER).tobytes()
    assert team.plant.receive("r1", wait=False) == NOTHING
    assert not first.receive(wait=False)


def test_the_end_of_the_walk_is_told(team: Team) -> None:
    end = team.open_agent()
    team.plant.close("time-over")
    await_true(lambda: end.receive(wait=True) or end.ended)
    assert (end.ended, end.closed) == ("time-over", False)


def test_who_leaves_is_gone_at_once() -> None:
    team = Team("local")
    with team.stack:
        end = team.open_agent()
        team.plant.close()
        assert not end.receive(wait=True)
        assert end.closed
        assert not end.ended


@pytest.mark.parametrize("link", ["local", "bus"])
def test_a_killed_agent_is_gone(link: str) -> None:
    team = Team(link)
    with team.stack:
        command = [*PYTHON, AGENT, team.config.bus.endpoint, link]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "open\n"
            assert team.plant.receive("r1", wait=True) == NOTHING
            process.send_signal(signal.SIGKILL)
            process.wait()
            begun = monotonic()
            await_true(lambda: team.plant.receive("r1", wait=True) == CLOSED)
            assert link == "bus" or monotonic() - begun < 0.05


def test_a_frozen_agent_holds_up_nobody_and_reads_what_there_was_room_for() -> None:
    team = Team("local")
    with team.stack:
        end = team.open_agent()
        for tick in range(5000):
            team.plant.send("r1", State.from_row(tick, 10**6 * tick, ROW))
        ticks = []
        while end.receive(wait=False):
            ticks.append(end.received.tick)
        assert 10 < len(ticks) < 5000
        assert ticks == list(range(len(ticks)))


def refused(team: Team, robot: str = "r1") -> str:
    """The one error of an agent that the plant does not take."""
    end = team.agent(robot)
    with pytest.raises(BusError) as raised:
        end.open(lambda: False)
    return str(raised.value)


def test_a_second_agent_of_a_robot_is_refused(team: Team) -> None:
    first = team.open_agent()
    if team.config.plant.link == "local":
        bus = team.open_bus("another")
        second = team.stack.enter_context(closing(AgentEnd(team.config, "r1", bus)))
        with pytest.raises(BusError, match="refused: a second agent of robot 'r1'"):
            second.open(lambda: False)
    team.plant.send("r1", State.from_row(3, 3, ROW))
    await_state(first)


def test_another_robot_s_name_is_refused(team: Team) -> None:
    three = load(None, {"team.robots": 3, **vars_of(team.config)})
    bus = team.open_bus("r3")
    end = AgentEnd(three, "r3", bus)
    bus.declare(HERE)
    assert bus.wait_for(HERE, {"sim"}, 20.0, lambda: False)
    if team.config.plant.link == "local":
        with pytest.raises(BusError, match="refused: robot 'r3', expected one of r1, r2"):
            end.open(lambda: False)
    end.close()


def vars_of(config: Config) -> dict[str, Any]:
    return {"bus.endpoint": config.bus.endpoint, "plant.link": config.plant.link}


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("VERSION", 2, "refused: version 2 of the plant link, expected 1"),
        ("LAYOUT", b"\x01" * 8, "refused: states and commands of layout 0101010101010101"),
    ],
)
def test_another_version_is_refused(
    team: Team, monkeypatch: pytest.MonkeyPatch, name: str, value: Any, said: str
) -> None:
    end = team.agent()
    head = list(packets.HEADER.unpack_from(end._hello))
    head[0 if name == "VERSION" else 6] = value
    end._hello = packets.HEADER.pack(*head) + end._hello[packets.HEADER.size :]
    with pytest.raises(BusError, match=said):
        end.open(lambda: False)


def test_a_process_of_another_user_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    team = Team("local")
    with team.stack:
        monkeypatch.setattr(connections.LocalConnection, "user", (other := os.getuid() + 1))
        assert f"refused: a process of user {other}" in refused(team)


def test_the_socket_is_in_a_folder_of_this_user_alone() -> None:
    team = Team("local")
    with team.stack:
        address = local_address(team.config, "sim")
        assert address is not None
        assert address.is_socket()
        assert stat.S_IMODE(address.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(address.stat().st_mode) == 0o600
    assert not address.exists()


def test_on_the_loopback_the_bus_does_not_stand_in_for_a_missing_socket() -> None:
    team = Team("bus")
    with team.stack:
        auto = load(None, {**vars_of(team.config), "plant.link": "auto"})
        end = team.agent(config=auto)
        with pytest.raises(BusError, match=r"no socket .*\.link.*plant.link = bus"):
            end.open(lambda: False)


def test_a_socket_that_a_killed_plant_left_is_replaced_and_a_live_one_is_not(
    tmp_path: Path,
) -> None:
    address = tmp_path / "x.link"
    left = connections.listen(address)
    left.close()
    assert address.exists()
    with closing(connections.listen(address)), pytest.raises(OSError, match="somebody listens"):
        connections.listen(address)


def test_what_is_no_packet_is_named() -> None:
    good = packets.text_packet(packets.END, 1, "why")
    buffer = packets.PacketBuffer()
    buffer.view[: len(good)] = good
    assert buffer.parse(len(good)) == ""
    assert (buffer.kind, buffer.robot, buffer.text(len(good))) == (packets.END, 1, "why")
    assert packets.fault_of(good[:20]).startswith("20 bytes, expected at least 32")
    kind = packets.HEADER.pack(packets.VERSION, 99, 0, 0, 0, 0, packets.LAYOUT)
    assert packets.fault_of(kind).startswith("kind 99")
    short = packets.HEADER.pack(packets.VERSION, packets.STATE, 0, 0, 0, 0, packets.LAYOUT)
    assert packets.fault_of(short) == "32 bytes, expected 432"
