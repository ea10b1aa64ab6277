"""Bytes from the bus, and texts of those who drive: every type of message, every answer."""

from __future__ import annotations

import json
import socket
from itertools import cycle
from pathlib import Path
from typing import Final, cast

import numpy as np

from quadriga.agents.inbox import Inbox, decode_packet, parse_message_id
from quadriga.agents.planning.interface import Expected
from quadriga.drive.client import ControlLink
from quadriga.drive.driver_words import read_driver_word
from quadriga.drive.gamepad import EVENT_BYTES, Gamepad, take, wish_of
from quadriga.drive.wish import standing
from quadriga.plant.server import REFUSED
from quadriga.recordings.echo import format_entry
from quadriga.shared.about import About
from quadriga.shared.bus.diagnostics import MemberAnswer, TeamView, describe_absent, diagnose
from quadriga.shared.bus.discovery import describe_process, read_about
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode, encode, envelope
from quadriga.shared.config.load import load
from quadriga.shared.errors import MessageError
from quadriga.shared.link import packets as packet_kinds
from quadriga.shared.link.agent_end import AgentEnd
from quadriga.shared.link.packets import END, HELLO, STATE_SIZE, WELCOME, RowPacket, text_packet
from quadriga.shared.link.ticks import gathered
from quadriga.shared.members import SIM, team_members
from quadriga.shared.messages import LiveFault, State
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.reader import ChunkEntry
from quadriga.shared.topics import STATE, TABLE
from quadriga.sim_server.world.faults import KINDS as FAULT_KINDS
from quadriga.sim_server.world.faults import build_components, parse_faults, with_time
from quadriga.status.gather import StatusFold
from tests.a1 import standing as standing_state
from tests.fuzz.damage import damage
from tests.fuzz.target import Reader, change_json, example
from tests.plant.test_server import command, served

_EVERYTHING: Final = Expected((1 << 40, 0), 1 << 40, 1 << 40, True)
_LOOK_EVERY: Final = 100  # messages


class Messages:
    """Every type of message, at everybody who takes it."""

    def __init__(self, _folder: Path) -> None:
        config = load(None, {"team.robots": 2, "estimator.kind": "truth"})
        self._inbox = Inbox(config, "r1", ("r2",))
        self._fold, self._heard = StatusFold(config), 0
        self._good = [(topic, encode(example(topic.type))) for topic in TABLE]
        self._topic = TABLE[0]

    def make(self, random: np.random.Generator) -> bytes:
        self._topic, good = self._good[int(random.integers(len(self._good)))]
        return damage(good, random)

    def read(self, content: bytes) -> None:
        for robot in ("r1", "r2"):
            self._inbox.take(self._topic.key("team", robot), content)
        while self._inbox.pop_state() is not None:
            pass
        self._inbox.pop_inputs(standing_state(0), _EVERYTHING)
        head = envelope(content)
        key = self._topic.key("team", "r1")
        entry = ChunkEntry(key, -1 if head is None else head[0], 0, content)
        self._heard += 1
        self._fold.add(entry.key, content, entry.tick, self._heard)
        if self._heard % _LOOK_EVERY == 0:
            self._fold.look(self._heard)
        line = format_entry(entry, full=True)
        assert line == printable_line(line)
        for item in gathered("team/sim/ticks", content):
            decode_packet(item.topic, item.payload)
            assert 0 <= item.log_ns < 1 << 63
        decode(content, self._topic.type)


def packets(_folder: Path) -> Reader:
    """What a plant and an agent send each other over the bus; the plant tells what it refuses."""
    server, bus = served()
    server.publish()
    agent, inbox = AgentEnd(server.config, "r1", cast("Bus", bus)), Inbox(server.config, "r1", ())
    plant_says = bus.heard[STATE.link_key("team", "r1")]
    plant_says(text_packet(WELCOME))
    agent.open(lambda: False)
    state = RowPacket(packet_kinds.STATE, 0, STATE_SIZE)
    texts = (text_packet(HELLO, 0, "r1"), text_packet(END, 0, "time-over"))
    good = (command(0), bytes(state.stamp(5, 5_000_000)), *texts)

    def read(content: bytes) -> None:
        plant_says(content)
        if agent.receive(wait=False):
            got = agent.received
            inbox.take_state(State.from_row(got.tick, got.stamp_ns, got.state.copy()))
            inbox.pop_state()
        assert agent.ended == printable_line(agent.ended)
        agent.ended = ""
        server.commands.latest.clear()
        bus.answer(content)
        if server.receive("r1", 0, wait=False) == REFUSED:
            raise MessageError("packet", server.commands.refused["r1"], "a command")

    return Reader(good, read)


def answers(_folder: Path) -> Reader:
    """What processes say of themselves when they are asked."""
    config = load(None, {"team.robots": 2})
    members = team_members(("r1", "r2"), central=False, recorded=False, plant_each=False)
    lead, names = describe_process(config, SIM), frozenset(("r1", "r2", SIM))

    def read(content: bytes) -> None:
        told = {"r1": [MemberAnswer(read_about("r1", content), 0, 1)]}
        view = TeamView(True, names, frozenset(), names, told, lead)
        for member in members:
            for found in diagnose(member, view):
                assert found.text == printable_line(found.text)
        describe_absent(members, view)
        decode(content, About)

    return Reader((encode(example(About)), encode(describe_process(config, "r1"))), read)


def orders(_folder: Path) -> Reader:
    """Texts in messages that order something while the team walks: faults, references of inputs."""
    components = tuple(build_components(load(None, {"team.robots": 2}).robot))
    kinds = [f"r1/{part} {kind} 1.5 2" for part, kind in zip(components, cycle(FAULT_KINDS))]
    ids = ("state:r1:5", "plan:r2:40.1", "reference::12")
    good = tuple(text.encode() for text in (*kinds, "r2/imu stuck 1", *ids))

    def change(text: bytes, random: np.random.Generator) -> bytes:
        return encode(LiveFault(0, 0, damage(text, random).decode("utf-8", "replace")))

    def read(content: bytes) -> None:
        text = decode(content, LiveFault).fault
        parse_message_id(text)
        timed = with_time(text, 1 << 40) if len(text.split()) in (2, 3) else text
        parse_faults(timed, ("r1", "r2"), components)

    return Reader(good, read, change)


def drivers(_folder: Path) -> Reader:
    """What drivers say to an operator, from a page or a program, and what a gamepad does."""
    rest = standing(load())
    words = (
        {"kind": "drive", "vx": 0.1, "vy": 0, "wz": -0.2, "height": 0.3, "held": True},
        {"kind": "estop", "text": "why", "number": 7},
        {"kind": "news"},
    )

    def read(content: bytes) -> None:
        pad = Gamepad()
        for at in range(0, len(content) - EVENT_BYTES + 1, EVENT_BYTES):
            pad, _ = take(pad, content[at : at + EVENT_BYTES])
        wish_of(pad, rest)
        said = read_driver_word(content)
        assert said.text == printable_line(said.text)

    return Reader(tuple(json.dumps(word).encode() for word in words), read, change_json)


def operator_answers(folder: Path) -> Reader:
    """What an operator answers a program of its machine."""
    path = folder / "team-1.sock"
    news = {"kind": "news", "driver": "page 1", "modes": {"r1": "walk"}, "number": 3}
    good = (json.dumps(news).encode() + b"\n", b'{"kind": "heard"}\n{"kind": "estop"}\n')

    def read(content: bytes) -> None:
        path.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(path))
            server.listen()
            with ControlLink(path) as link:
                operator, _ = server.accept()
                with operator:
                    operator.sendall(content)
                link.await_stop()

    return Reader(good, read, change_json)
