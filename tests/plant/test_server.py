"""What the world says on the bus can be read by whoever hears it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, cast

import msgpack
import numpy as np
import pytest

from quadriga.plant.process import _check_end
from quadriga.plant.protocol import Plant
from quadriga.plant.server import FALL_LINGER_MS, PlantServer
from quadriga.shared import codes
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import MAX_TEXT, decode, encode
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Clock, Command, Event, State
from quadriga.shared.topics import CLOCK, COMMAND, EVENT, POSTURE, STATE, TRUTH
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import configured


class Listener:
    """A bus that brings `arrived`, and keeps what is published: key, whether it waits, payload."""

    def __init__(self) -> None:
        self.packets: list[tuple[str, bool, bytes]] = []
        self.arrived: list[tuple[str, bytes]] = []

    def publisher(
        self, key: str, *, droppable: bool = False, urgent: bool = False
    ) -> Callable[[bytes], None]:
        return lambda payload: self.packets.append((key, not (droppable or urgent), payload))

    def drain(self) -> list[tuple[str, bytes]]:
        arrived, self.arrived = self.arrived, []
        return arrived

    def events(self) -> list[Event]:
        return [
            decode(payload, Event) for key, _, payload in self.packets if key == "team/sim/event"
        ]


def served(**world: Any) -> tuple[PlantServer, Listener]:
    config, listener = configured(**world), Listener()
    return PlantServer(config, World(config), cast("Bus", listener)), listener


@pytest.mark.parametrize(
    "body",
    [{"schema": "x" * 900_000}, {"schema": 1} | {f"key {i}": 0 for i in range(50_000)}],
    ids=["text", "keys"],
)
def test_a_malformed_command_is_reported_in_few_words(body: dict[str, object]) -> None:
    server, listener = served()
    server.commands.take(COMMAND.key("team", "r1"), msgpack.packb(body), tick=0, oldest=0)
    server.step({})
    event = next(event for event in listener.events() if event.kind == "fault")
    assert event.detail.startswith("1 commands dropped: command: got ")
    assert len(event.detail) < 300


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
    keys = {STATE.key("team", "r1"), TRUTH.key("team"), CLOCK.key("team"), EVENT.key("team")}
    assert {key for key, _, _ in listener.packets} >= keys
    assert {waits for key, waits, _ in listener.packets if key in keys} == {mode == "lockstep"}


def test_who_watches_gets_the_states_of_some_ticks_and_holds_up_nobody() -> None:
    server, listener = served()
    for _ in range(25):
        server.publish()
        server.step({})
    key = STATE.key("team", "r1")
    states = [payload for sent, _, payload in listener.packets if sent == key]
    postures = [p for p in listener.packets if p[0] == POSTURE.key("team", "r1")]
    assert [payload for _, _, payload in postures] == [states[0], states[10], states[20]]
    assert not any(waits for _, waits, _ in postures)


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
    config, listener = configured(duration=2.0), Listener()
    server = PlantServer(config, BlindPlant(down), cast("Bus", listener))
    end = None
    while end is None:
        server.publish()
        end = server.step({})
    of_robot = {topic.key("team", "r1") for topic in (STATE, POSTURE)}
    ours = of_robot | {EVENT.key("team"), CLOCK.key("team")}
    assert {key for key, _, _ in listener.packets} <= ours
    clock = [decode(p, Clock).tick for key, _, p in listener.packets if key == CLOCK.key("team")]
    assert clock == list(range(0, server.plant.tick, 10))
    fallen, over = (codes.FALLEN, "fall of r1"), (codes.TIME_OVER, "end of world.duration")
    assert end == (fallen if down else over)
    assert server.plant.tick == last


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_no_command_of_a_tick_counts_that_came_before_the_robot_s_state_of_it(mode: str) -> None:
    """A forged one that waits in the inbox would count before the agent's own."""
    server, listener = served(mode=mode)
    key, zero = COMMAND.key("team", "r1"), np.zeros((4, 12))
    own, forged = (encode(Command(1, 10**6, np.full(12, tau), *zero)) for tau in (1.0, 9.0))
    server.publish()
    assert server.take(key, forged, oldest=0) == "", "the state of tick 1 is not out yet"
    server.step({})
    listener.arrived.append((key, forged))
    server.publish()
    listener.arrived.append((key, own))
    for packet in listener.drain():
        server.take(*packet, oldest=0)
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
