"""What the world says on the bus can be read by whoever hears it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from quadriga.plant.process import _check_end
from quadriga.plant.protocol import Plant
from quadriga.plant.server import FALL_LINGER_MS, NEWER, REFUSED, PlantServer
from quadriga.shared import codes
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import MAX_TEXT, decode
from quadriga.shared.config.sections import PlantConfig
from quadriga.shared.errors import ProcessError
from quadriga.shared.link import packets
from quadriga.shared.link.packets import (
    COMMAND_SIZE,
    HEADER,
    HELLO,
    WELCOME,
    RowPacket,
    text_packet,
)
from quadriga.shared.link.ticks import gathered
from quadriga.shared.messages import Clock, Command, Event, State
from quadriga.shared.topics import CLOCK, COMMAND, EVENT, STATE, TICKS, TRUTH
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import configured

LINK, BATCHES = STATE.link_key("team", "r1"), TICKS.key("team", "sim")


class Listener:
    """A bus that keeps what is published: key, whether it waits, payload; an agent may be on it."""

    name = "sim"

    def __init__(self) -> None:
        self.packets: list[tuple[str, bool, bytes]] = []
        self.heard: dict[str, Callable[[bytes], None]] = {}

    def publisher(
        self, key: str, *, waits: bool = True, urgent: bool = False
    ) -> Callable[[bytes], None]:
        return lambda payload: self.packets.append((key, waits and not urgent, payload))

    def hear(self, key: str, call: Callable[[bytes], None]) -> None:
        self.heard[key] = call

    def members_at(self, _stage: str) -> frozenset[str]:
        return frozenset({"r1"})

    def drain(self) -> list[tuple[str, bytes]]:
        return []

    def answer(self, packet: bytes) -> None:
        """Send what the agent of r1 does."""
        self.heard[COMMAND.link_key("team", "r1")](packet)

    def payloads(self, key: str) -> list[bytes]:
        return [payload for sent, _, payload in self.packets if sent == key]

    def events(self) -> list[Event]:
        return [decode(payload, Event) for payload in self.payloads("team/sim/event")]


def served(plant: Plant | None = None, **world: Any) -> tuple[PlantServer, Listener]:
    """A plant whose link goes over the bus to the agent of r1."""
    config, listener = replace(configured(**world), plant=PlantConfig("bus")), Listener()
    server = PlantServer(config, plant or World(config), cast("Bus", listener))
    server.link.open()
    listener.answer(text_packet(HELLO, 0, "r1"))
    return server, listener


def command(tick: int, tau: float = 1.0) -> bytes:
    packet = RowPacket(packets.COMMAND, 0, COMMAND_SIZE)
    packet.row[0] = tau
    return bytes(packet.stamp(tick, 10**6 * tick))


@pytest.mark.parametrize(
    ("packet", "error"),
    [
        (b"", "1 bytes, expected at least 32"),
        (b"x" * 900_000, "version 30840 of the plant link"),
        (command(0)[:-1], "511 bytes, expected 512"),
        (text_packet(WELCOME, 0, "x" * 512), "a packet of kind 2, expected a command"),
        (command(0, np.nan), "command.tau: got nan"),
    ],
    ids=["empty", "foreign", "short", "text", "not a number"],
)
def test_a_malformed_command_drives_no_robot_and_is_reported_in_few_words(
    packet: bytes, error: str
) -> None:
    server, listener = served()
    server.publish()
    listener.answer(packet)
    assert server.receive("r1", 0, wait=False) == REFUSED
    server.step({})
    event = next(event for event in listener.events() if event.kind == "fault")
    assert (event.code, event.robot) == (codes.MALFORMED, "r1")
    assert event.detail.startswith(f"1 commands dropped: {error}")
    assert len(event.detail) < 300
    assert server.commands.latest == {}


def test_what_is_announced_fits_an_event_and_cannot_forge_the_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    server, listener = served()
    server.announce(codes.MALFORMED, "r1", "x" * (MAX_TEXT + 1))
    assert listener.events()[0].detail == "x" * (MAX_TEXT - 1) + "…"
    capsys.readouterr()
    server.announce(codes.MALFORMED, "", "1 commands dropped: \x1b[2J\nstop")
    said = capsys.readouterr().err
    assert "\x1b" not in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_in_real_time_nothing_waits_for_who_does_not_listen(mode: str) -> None:
    server, listener = served(mode=mode)
    server.publish()
    for code in (codes.PUSH, codes.RESET, codes.FALL, codes.SIGNAL):
        server.announce(code, "", "")
    keys = {LINK, BATCHES, TRUTH.key("team"), CLOCK.key("team"), EVENT.key("team")}
    assert {key for key, _, _ in listener.packets} == keys
    assert {waits for _, waits, _ in listener.packets} == {mode == "lockstep"}


def test_who_looks_on_gets_each_state_and_command_in_batches_of_some_ticks() -> None:
    server, listener = served()
    for tick in range(25):
        server.publish()
        listener.answer(command(tick))
        assert server.receive("r1", tick, wait=False) == NEWER
        server.step({})
    server.publish_batch()
    batches = [gathered("team/sim/ticks", payload) for payload in listener.payloads(BATCHES)]
    assert [len(batch) for batch in batches] == [1, 20, 20, 9]
    told = [(item.topic, item.robot, item.tick) for batch in batches for item in batch]
    assert told == [(topic, "r1", tick) for tick in range(25) for topic in (STATE, COMMAND)]
    sent = [payload[HEADER.size :] for payload in listener.payloads(LINK)][1:]  # after a welcome
    states = [
        decode(i.payload, State).row.tobytes() for b in batches for i in b if i.topic is STATE
    ]
    assert states == sent


class BlindPlant(Plant):
    """One robot that stands, or is down at the first tick; nobody knows where it is."""

    names: tuple[str, ...] = ("r1",)

    def __init__(self, down: str = "") -> None:
        self.tick, self._down = 0, down

    def states(self) -> dict[str, State]:
        return {"r1": State.from_row(self.tick, self.tick * 1_000_000, np.zeros(50))}

    def step(self, commands: Mapping[str, Command]) -> list[Event]:
        self.tick += 1
        return [Event.of(1, self._down, "r1", "")] if self._down and self.tick == 1 else []


@pytest.mark.parametrize(
    ("down", "last"),
    [("", 2000), (codes.FALL, 1 + FALL_LINGER_MS), (codes.ROBOT_STOPPED, 1)],
    ids=["stands", "falls", "stopped"],
)
def test_any_plant_is_served(down: str, last: int) -> None:
    server, listener = served(BlindPlant(down), duration=2.0)
    end = None
    while end is None:
        server.publish()
        end = server.step({})
    ours = {LINK, BATCHES, EVENT.key("team"), CLOCK.key("team")}
    assert {key for key, _, _ in listener.packets} <= ours
    clock = [decode(payload, Clock).tick for payload in listener.payloads(CLOCK.key("team"))]
    assert clock == list(range(0, server.plant.tick, 50))
    fallen, over = (codes.FALLEN, "fall of r1"), (codes.TIME_OVER, "end of world.duration")
    assert end == (fallen if down else over)
    assert server.plant.tick == last


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_no_command_of_a_tick_counts_that_came_before_the_robot_s_state_of_it(mode: str) -> None:
    """A forged one would count before the agent's own."""
    server, listener = served(mode=mode)
    server.publish()
    listener.answer(command(1, 9.0))
    assert server.receive("r1", 0, wait=False) == REFUSED, "the state of tick 1 is not out yet"
    server.step({})
    server.publish()
    listener.answer(command(1, 1.0))
    assert server.receive("r1", 0, wait=False) == NEWER
    assert server.commands.latest["r1"].tau[0] == 1.0


def test_an_unstable_simulation_ends_the_walk_at_once_and_is_an_error() -> None:
    server, listener = served(robots=1)
    cast("World", server.plant).physics.qvel[0] = np.nan
    end = server.step({})
    assert end is not None
    assert end.code == codes.PLANT_FAILED
    assert listener.events()[-1].code == codes.UNSTABLE
    with pytest.raises(ProcessError, match="got unstable simulation: "):
        _check_end(end, "team", 1)
