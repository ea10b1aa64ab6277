"""One robot's agent in a recording: what it may have received, and what it sent."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox, Order, Source, decode_packet, order_of
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.messages import Consumed
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.topics import (
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
ALL_TOLD: Final = 1 << 62  # ms
_REPORT_AFTER: Final = 2000  # entries
_OUTLIVED_MS: Final = 1000  # of states after its last command: a process that did not see the end


@dataclass(slots=True)
class AgentLog:
    """What a recording holds of one agent.

    Attributes:
        states: own sensors by tick, all payloads of a tick in the order of the file.
        received: everything else it may have taken in: packets of each source by order.
        records: what it reported that it took in, by tick.
        sent: commands, measurements and own plans by topic and order, payloads as above.
        peers_awake: ticks of the 100 Hz grid at which a peer gave a command, by peer.
        last: tick of its last command or record, at most that of the last state; −1: none.
        told: tick up to which the records tell all that it took in: a process that was killed may
            have sent a command, which goes first, and no record of that step.
    """

    states: dict[int, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    received: dict[Source, dict[Order, list[Packet]]] = field(
        default_factory=lambda: defaultdict(lambda: defaultdict(list))
    )
    records: dict[int, Consumed] = field(default_factory=dict)
    sent: dict[Serial, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    peers_awake: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    last: int = -1
    told: int = ALL_TOLD


def read_agent_log(
    recording: Recording,
    config: Config,
    agent: Agent,
    inbox: Inbox,
    progress: Callable[[int], None] = lambda tick: None,
) -> AgentLog:
    """Everything of one agent in a recording.

    Args:
        recording: of a walk.
        config: its configuration.
        agent: the agent as it was configured.
        inbox: knows what it had subscribed to.
        progress: called with the tick now and then.

    Raises:
        RecordingError: the recording holds nothing of this robot, nor what a replay needs.
    """
    log = AgentLog()
    handlers = _build_handlers(log, config, agent, inbox)
    stop_key = ESTOP.key(config.team.name)  # obeyed even where its tick cannot be read
    for count, entry in enumerate(recording.entries(keys=handlers)):
        if entry.tick >= 0 or entry.key == stop_key:
            handlers[entry.key](entry)
        if count % _REPORT_AFTER == 0:
            progress(entry.tick)
    # A forged tick must not ask for years of steps.
    newest = max(log.states, default=-1)
    log.last = min(log.last, newest)
    _check_complete(log, recording, config, agent.robot)
    saw_end = recording.complete and newest - log.last <= _OUTLIVED_MS
    if config.world.mode == "realtime" and not saw_end:
        log.told = max(log.records)
    return log


def _build_handlers(
    log: AgentLog, config: Config, agent: Agent, inbox: Inbox
) -> Mapping[str, Callable[[ChunkEntry], None]]:
    """What to do with an entry, by its key."""
    team, robot = config.team.name, agent.robot

    def keep_command(entry: ChunkEntry) -> None:
        log.sent[COMMAND.name, entry.tick, 0].append(entry.payload)
        log.last = max(log.last, entry.tick)

    def keep_record(entry: ChunkEntry) -> None:
        record = decode_packet(INPUTS, entry.payload)
        if isinstance(record, Consumed):
            log.records[record.tick] = record
            log.last = max(log.last, record.tick)

    handlers: dict[str, Callable[[ChunkEntry], None]] = {}
    for key, (topic, sender) in inbox.topics.items():
        if topic not in (STATE, EVENT):
            handlers[key] = _keep_received(log, topic, sender)
    handlers[STATE.key(team, robot)] = _keep_states(log)
    handlers[COMMAND.key(team, robot)] = keep_command
    handlers[INPUTS.key(team, robot)] = keep_record
    handlers[MEASUREMENT.key(team, robot)] = _keep_sent(log, MEASUREMENT)
    if not find_kind(config.planner.kind).central:
        handlers[PLAN.key(team, robot)] = _keep_sent(log, PLAN)
    for peer in agent.peers:
        handlers[COMMAND.key(team, peer)] = _keep_ticks(log.peers_awake[peer])
    return handlers


def _keep_states(log: AgentLog) -> Callable[[ChunkEntry], None]:
    def keep(entry: ChunkEntry) -> None:
        log.states[entry.tick].append(entry.payload)

    return keep


def _keep_received(log: AgentLog, topic: Topic, sender: str) -> Callable[[ChunkEntry], None]:
    by_order = log.received[topic.name, sender]

    def keep(entry: ChunkEntry) -> None:
        message = decode_packet(topic, entry.payload)
        if message is not None:  # what is not valid, the agent dropped
            by_order[order_of(message)].append((entry.key, entry.payload))

    return keep


def _keep_sent(log: AgentLog, topic: Topic) -> Callable[[ChunkEntry], None]:
    def keep(entry: ChunkEntry) -> None:
        message = decode_packet(topic, entry.payload)
        order = (entry.tick, 0) if message is None else order_of(message)
        log.sent[topic.name, *order].append(entry.payload)

    return keep


def _keep_ticks(ticks: set[int]) -> Callable[[ChunkEntry], None]:
    def keep(entry: ChunkEntry) -> None:
        if entry.tick % SAMPLE_MS == 0:
            ticks.add(entry.tick)

    return keep


def _check_complete(log: AgentLog, recording: Recording, config: Config, robot: str) -> None:
    path = str(recording.path)
    if not log.states or log.last < 0:
        what = "states" if not log.states else "commands"
        raise RecordingError(
            path, f"no {what} of {robot}", f"every message of {robot}", recording.cut
        )
    if config.world.mode == "realtime" and not log.records:
        raise RecordingError(
            path,
            f"no message on {INPUTS.key(config.team.name, robot)}",
            "what the agent took in at which tick",
            "in real time nothing else tells; recorded by an older version, or left out",
        )
