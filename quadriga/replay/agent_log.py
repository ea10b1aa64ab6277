"""One robot's agent in a recording: all that it may have heard, and all that it said."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from quadriga.agents.agent import Agent
from quadriga.agents.inbox.inbox import Inbox, Order, Source, order_of, read
from quadriga.agents.inbox.intake_log import ANYONE
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.wire.messages import Consumed
from quadriga.shared.wire.topics import (
    COMMAND,
    ESTOP,
    EVENT,
    INPUTS,
    MEASUREMENT,
    PLAN,
    SAMPLE_MS,
    STATE,
    Topic,
)

Packet = tuple[str, bytes]  # key, payload
Serial = tuple[str, int, int]  # topic of an output and its order
_REPORT_AFTER: Final = 2000  # entries


@dataclass(slots=True)
class AgentLog:
    """What a recording holds of one agent.

    Attributes:
        states: own sensors by tick, all payloads of a tick in the order of the file.
        heard: everything else it may have taken in: packets of each source by order.
        records: what it said it took in, by tick.
        said: commands, measurements and own plans by topic and order, payloads as above.
        peers_awake: ticks of the 100 Hz grid at which a peer gave a command, by peer.
        last: tick of its last command or record, at most that of the last state; −1: none.
    """

    states: dict[int, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    heard: dict[Source, dict[Order, list[Packet]]] = field(
        default_factory=lambda: defaultdict(lambda: defaultdict(list))
    )
    records: dict[int, Consumed] = field(default_factory=dict)
    said: dict[Serial, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    peers_awake: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    last: int = -1


def read_tape(
    recording: Recording,
    config: Config,
    agent: Agent,
    arrivals: Inbox,
    progress: Callable[[int], None] = lambda tick: None,
) -> AgentLog:
    """Everything of one agent in a recording.

    Args:
        recording: of a walk.
        config: its configuration.
        agent: the agent as it was configured.
        arrivals: says what it had subscribed to.
        progress: told the tick now and then.

    Raises:
        RecordingError: the recording holds nothing of this robot, nor what a replay needs.
    """
    tape = AgentLog()
    takers = _takers(tape, config, agent, arrivals)
    stop_key = ESTOP.key(config.team.name)  # obeyed even where its tick cannot be read
    for count, entry in enumerate(recording.entries(keys=takers)):
        if entry.tick >= 0 or entry.key == stop_key:
            takers[entry.key](entry)
        if count % _REPORT_AFTER == 0:
            progress(entry.tick)
    # A forged tick must not ask for years of steps.
    tape.last = min(tape.last, max(tape.states, default=-1))
    _check(tape, recording, config, agent.robot)
    return tape


def _takers(
    tape: AgentLog, config: Config, agent: Agent, arrivals: Inbox
) -> Mapping[str, Callable[[ChunkEntry], None]]:
    """What to do with an entry, by its key."""
    team, robot = config.team.name, agent.robot

    def state(entry: ChunkEntry) -> None:
        tape.states[entry.tick].append(entry.payload)

    def command(entry: ChunkEntry) -> None:
        tape.said[COMMAND.name, entry.tick, 0].append(entry.payload)
        tape.last = max(tape.last, entry.tick)

    def record(entry: ChunkEntry) -> None:
        found = read(INPUTS, entry.payload)
        if isinstance(found, Consumed):
            tape.records[found.tick] = found
            tape.last = max(tape.last, found.tick)

    takers: dict[str, Callable[[ChunkEntry], None]] = {}
    for key, (topic, sender) in arrivals.topics.items():
        if topic not in (STATE, EVENT):
            takers[key] = _listener(tape, topic, ANYONE if topic is ESTOP else sender)
    takers[STATE.key(team, robot)] = state
    takers[COMMAND.key(team, robot)] = command
    takers[INPUTS.key(team, robot)] = record
    takers[MEASUREMENT.key(team, robot)] = _speaker(tape, MEASUREMENT)
    if config.planner.kind not in CENTRAL:
        takers[PLAN.key(team, robot)] = _speaker(tape, PLAN)
    for peer in agent.peers:
        takers[COMMAND.key(team, peer)] = _watcher(tape.peers_awake[peer])
    return takers


def _listener(tape: AgentLog, topic: Topic, sender: str) -> Callable[[ChunkEntry], None]:
    by_order = tape.heard[topic.name, sender]

    def listen(entry: ChunkEntry) -> None:
        message = read(topic, entry.payload)
        if message is not None:  # what is not valid, the agent dropped
            by_order[order_of(message)].append((entry.key, entry.payload))

    return listen


def _speaker(tape: AgentLog, topic: Topic) -> Callable[[ChunkEntry], None]:
    def speak(entry: ChunkEntry) -> None:
        message = read(topic, entry.payload)
        order = (entry.tick, 0) if message is None else order_of(message)
        tape.said[topic.name, *order].append(entry.payload)

    return speak


def _watcher(ticks: set[int]) -> Callable[[ChunkEntry], None]:
    def watch(entry: ChunkEntry) -> None:
        if entry.tick % SAMPLE_MS == 0:
            ticks.add(entry.tick)

    return watch


def _check(tape: AgentLog, recording: Recording, config: Config, robot: str) -> None:
    path = str(recording.path)
    if not tape.states or tape.last < 0:
        what = "states" if not tape.states else "commands"
        raise RecordingError(
            path, f"no {what} of {robot}", f"every message of {robot}", recording.cut
        )
    if config.world.mode == "realtime" and not tape.records:
        raise RecordingError(
            path,
            f"no message on {INPUTS.key(config.team.name, robot)}",
            "what the agent took in at which tick",
            "in real time nothing else tells; recorded by an older version, or left out",
        )
