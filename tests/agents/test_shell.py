"""The loop around an agent: what it takes in when, with plain ticks and without."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox
from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.shell import AgentShell
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.link.agent_end import AgentEnd
from quadriga.shared.link.packets import (
    COMMAND,
    COMMAND_SIZE,
    HEADER,
    STATE,
    PacketBuffer,
    RowPacket,
)
from quadriga.shared.messages import Command, Consumed, EStop, State
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.topics import COMMAND as COMMANDS
from quadriga.shared.topics import ESTOP, INPUTS, MEASUREMENT, PLAN
from quadriga.shared.topics import STATE as STATES
from tests.golden import scenario
from tests.golden.rerun import rerun

CONFIG = scenario.config()
TEAM = CONFIG.team.name
Packets = list[tuple[str, bytes]]


class Played:
    """Bus and link of r1 that play a recording; peers' messages come when they are waited for."""

    team = TEAM

    def __init__(self, says: Callable[[int], Packets]) -> None:
        entries = list(Recording(scenario.RECORDING).entries())
        own = {topic.key(TEAM, "r1") for topic in (STATES, COMMANDS, MEASUREMENT, PLAN)}
        self.states = [decode(e.payload, State) for e in entries if e.key == STATES.key(TEAM, "r1")]
        self.others = [e for e in entries if e.key not in own]
        self.mail, self.sent, self.told = Packets(), Packets(), list[bytes]()
        self.received, self.command = PacketBuffer(), RowPacket(COMMAND, 0, COMMAND_SIZE)
        self.ended, self.closed, self.malformed = "", False, 0
        self.says, self.tick = says, -1

    # The link.

    def receive(self, *, wait: bool) -> bool:
        if not wait:
            return False
        if not self.states:
            self.ended = "over"
            return False
        state = self.states.pop(0)
        self.tick, self.received.tick, self.received.kind = state.tick, state.tick, STATE
        self.received.stamp_ns = state.stamp_ns
        self.received.state[:] = state.row
        return True

    def send(self, packet: memoryview) -> None:
        self.told.append(bytes(packet))

    # The bus.

    def publisher(self, key: str, **_: bool) -> Callable[[bytes], None]:
        return lambda payload: self.sent.append((key, payload))

    def get(self, timeout: float) -> tuple[str, bytes] | None:
        if timeout:  # somebody waits for what peers have sent by now
            self.mail += self.says(self.tick)
            while self.others and self.others[0].tick <= self.tick:
                entry = self.others.pop(0)
                self.mail.append((entry.key, entry.payload))
        return self.mail.pop(0) if self.mail else None

    def drain(self) -> Packets:
        drained, self.mail = self.mail, []
        return drained

    def members_at(self, stage: str) -> frozenset[str]:
        return frozenset(("sim", "r2", "operator"))


def walk(says: Callable[[int], Packets] = lambda tick: []) -> Played:
    use_one_blas_thread()
    played, predictor = Played(says), load_checked(scenario.PREDICTOR, CONFIG)[0]
    agent = Agent(CONFIG, "r1", predictor)
    inbox = Inbox(CONFIG, "r1", agent.peers)
    shell = AgentShell(CONFIG, agent, inbox, cast("Bus", played), cast("AgentEnd", played))
    shell.walk(lambda: False)
    return played


def test_a_walk_by_plain_ticks_is_that_by_steps() -> None:
    played, predictor = walk(), load_checked(scenario.PREDICTOR, CONFIG)[0]
    rows = [np.frombuffer(packet, np.float64, offset=HEADER.size) for packet in played.told]
    answers = [Command.from_row(k, 10**6 * k, row) for k, row in enumerate(rows)]
    commands = [(COMMANDS.key(TEAM, "r1"), encode(answer)) for answer in answers]
    others = {topic.key(TEAM, "r1") for topic in (MEASUREMENT, PLAN)}
    sent = [*commands, *(packet for packet in played.sent if packet[0] in others)]
    stepped = rerun(Recording(scenario.RECORDING).entries(), CONFIG, "r1", predictor)
    assert sorted(sent) == sorted(stepped)
    assert not [key for key, _ in played.sent if key == INPUTS.key(TEAM, "r1")]


def test_what_comes_while_peers_are_waited_for_counts_from_the_next_tick_on() -> None:
    """The command of this tick is out; who replays the walk is told when it was taken in."""
    came = list[int]()

    def press(tick: int) -> Packets:
        if tick < 400 or tick % 100 == 0 or came:
            return []
        came.append(tick)
        return [(ESTOP.key(TEAM), encode(EStop(tick, 10**6 * tick, "dog")))]

    played = walk(press)
    damped = [
        HEADER.unpack_from(packet)[4]
        for packet in played.told
        if np.frombuffer(packet, np.float64, offset=HEADER.size)[Command.CUTS["kd"]].any()
    ]
    assert came
    assert damped[0] == came[0] + 1
    said = [decode(payload, Consumed) for key, payload in played.sent if key.endswith("/inputs")]
    assert [(r.tick, r.taken) for r in said if any("estop" in text for text in r.taken)] == [
        (came[0] + 1, (f"estop:anyone:{came[0]}",))
    ]
