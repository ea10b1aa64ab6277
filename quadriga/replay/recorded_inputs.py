"""What an agent took in at each of its steps, from its records or by the rules of lock-step."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from quadriga.agents.agent import Agent, Inputs
from quadriga.agents.inbox import (
    Due,
    Inbox,
    Order,
    Source,
    format_message_id,
    has_rule,
    parse_message_id,
)
from quadriga.agents.planning.interface import NOTHING
from quadriga.replay.agent_log import AgentLog, Packet
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Consumed, State
from quadriga.shared.topics import INPUTS, MEASUREMENT, REQUESTS, SAMPLE_MS, STATE

_BEFORE: Final = (-1, 0)
_LONGEST_GAP: Final = 1000  # ticks without a state or a record that are gone through one by one
_WORDS: Final = frozenset(word.name for word in REQUESTS)


@dataclass(frozen=True, slots=True)
class StepInputs:
    """One step of the agent.

    Attributes:
        tick: its tick.
        inputs: what it took in; None without a state.
        missing: what of it is not in the recording.
        told: whether the agent lived to tell what it took in.
    """

    tick: int
    inputs: Inputs | None
    missing: tuple[str, ...] = ()
    told: bool = True


class RecordedInputs:
    """Recorded packets, handed to `Inbox` when the agent had them.

    Args:
        config: the configuration of the recording.
        agent: the agent as it was configured then; only asked what it awaits.
        inbox: what the agent's process would hold its messages in.
        log: what is in the recording.
    """

    def __init__(self, config: Config, agent: Agent, inbox: Inbox, log: AgentLog) -> None:
        self._lockstep = config.world.mode == "lockstep"
        self._agent, self._inbox, self._log = agent, inbox, log
        self._state_key = STATE.key(config.team.name, agent.robot)
        self._after = {r.tick - r.passed - 1: r.tick for r in log.records.values()}
        self._lost = _find_lost_records(log.records, agent.robot)
        references = (parse_message_id(text) for r in log.records.values() for text in r.taken)
        self._claimed = {reference for reference in references if reference}
        self._queues = {source: sorted(packets) for source, packets in log.received.items()}
        self._known = sorted({*log.states, *log.records})
        self._awake = {peer: sorted(ticks) for peer, ticks in log.peers_awake.items()}
        self._due: dict[Source, Order] = {}  # in lock-step: up to where all has been awaited

    def steps(self) -> Iterator[StepInputs]:
        """Every step up to the agent's last command.

        Of a longer gap the first ticks are enough: forged ticks must not ask for years of steps.
        """
        tick = self._next(-1)
        while tick <= self._log.last:
            yield self._replay_step(tick)
            tick = self._next(tick)

    def _next(self, tick: int) -> int:
        following = self._after.get(tick, tick + 1)
        place = bisect_left(self._known, following)
        before = self._known[place - 1] if place else -1
        if following - before <= _LONGEST_GAP:
            return following
        return self._known[place] if place < len(self._known) else self._log.last + 1

    def _replay_step(self, tick: int) -> StepInputs:
        record = self._log.records.get(tick)
        missing = list(self._lost.get(tick, ()))
        state = self._take_state(tick)  # first: it sets the time, see `Inbox`
        awaited = self._agent.expected(tick) if self._lockstep else NOTHING
        wanted = [] if awaited == NOTHING else self._inbox.list_due(tick, awaited)
        if record is not None:
            missing += self._take_listed(record)
            self._pass_over(wanted)
        else:
            for source, due in wanted:
                missing += self._take_up_to(source, due)
        if state is None:
            missing.append(f"state of {self._agent.robot} at tick {tick}")
            return StepInputs(tick, None, tuple(missing))
        inputs = self._inbox.pop_inputs(state, awaited)
        return StepInputs(tick, inputs, tuple(missing), told=tick <= self._log.told)

    def _take_state(self, tick: int) -> State | None:
        """The first valid state of a tick: the agent would not have stepped at a second one."""
        for payload in self._log.states.pop(tick, ()):
            self._inbox.take(self._state_key, payload)
            state = self._inbox.pop_state()
            if state is not None:
                return state
        return None

    def _take_listed(self, record: Consumed) -> list[str]:
        """Hand over what a record lists; names of what of it is not there."""
        missing = []
        for text in record.taken:
            packet = self._find_packet(text)
            if packet is None:
                missing.append(text)
            else:
                self._inbox.take(*packet)
        return missing

    def _find_packet(self, text: str) -> Packet | None:
        """The next recorded packet that a record refers to.

        What people say they may say twice, the same to the byte, and the recorder hear once.
        """
        reference = parse_message_id(text)
        if reference is None:
            return None
        source, order = reference
        packets = self._log.received.get(source, {}).get(order, [])
        if packets and not (len(packets) == 1 and source[0] in _WORDS):
            return packets.pop(0)
        return packets[0] if packets else None

    def _pass_over(self, wanted: list[Due]) -> None:
        """Drop what a step with a record awaited and did not get: the agent never got it later."""
        for source, due in wanted:
            queue = self._queues.get(source, [])
            while queue and queue[0] <= due:
                queue.pop(0)
            self._due[source] = due

    def _take_up_to(self, source: Source, due: Order) -> list[str]:
        """Hand over what is due by the rules of lock-step; names of what of it is not there."""
        queue, received = self._queues.get(source, []), self._log.received.get(source, {})
        missing = self._missing_samples(source, due) + ([] if due in received else [due])
        while queue and queue[0] <= due:
            order = queue.pop(0)
            if has_rule(source, order) and (source, order) not in self._claimed:
                for packet in received[order]:
                    self._inbox.take(*packet)
        self._due[source] = due
        return [format_message_id(source, order) for order in missing]

    def _missing_samples(self, source: Source, due: Order) -> list[Order]:
        """A peer's samples before the last one, at ticks at which it gave a command."""
        topic, peer = source
        if topic != MEASUREMENT.name:
            return []
        before, awake = self._due.get(source, _BEFORE), self._awake.get(peer, [])
        first = max(before[0], 0) // SAMPLE_MS * SAMPLE_MS + SAMPLE_MS
        ticks = awake[bisect_left(awake, first) : bisect_left(awake, due[0])]
        received = self._log.received.get(source, {})
        return [(tick, 0) for tick in ticks if (tick, 0) not in received]


def _find_lost_records(records: dict[int, Consumed], robot: str) -> dict[int, tuple[str, ...]]:
    """Names of the records that the recording lacks, by the first tick they may be of."""
    lost: dict[int, tuple[str, ...]] = {}
    next_number, after = 0, -1
    for tick in sorted(records):
        number = records[tick].number
        if number > next_number:
            lost_records = f"{number - next_number} of {INPUTS.name} of {robot}"
            lost[after + 1] = (f"{lost_records} between ticks {after} and {tick}",)
        next_number, after = number + 1, tick
    return lost
