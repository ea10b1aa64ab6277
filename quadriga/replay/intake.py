"""What an agent took in at each of its steps, from a recording: the rules, and what it said."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from quadriga.agents.agent import Agent, Inputs
from quadriga.agents.inbox.inbox import Inbox, Order, Source, Wanted
from quadriga.agents.inbox.intake_log import expected, reference_to, referred
from quadriga.agents.planning.interface import NOTHING
from quadriga.replay.agent_log import AgentLog
from quadriga.shared.config.sections import Config
from quadriga.shared.wire.messages import Consumed, State
from quadriga.shared.wire.topics import INPUTS, MEASUREMENT, SAMPLE_MS, STATE

_BEFORE: Final = (-1, 0)


@dataclass(frozen=True, slots=True)
class Fed:
    """One step of the agent.

    Attributes:
        tick: its tick.
        inputs: what it took in; None without a state.
        missing: what of it is not in the recording.
    """

    tick: int
    inputs: Inputs | None
    missing: tuple[str, ...] = ()


class Feed:
    """Recorded packets, handed to `Inbox` when the agent had them.

    Args:
        config: the configuration of the recording.
        agent: the agent as it was configured then; only asked what it awaits.
        arrivals: what the agent's process would hold its messages in.
        tape: what is in the recording.
    """

    def __init__(self, config: Config, agent: Agent, arrivals: Inbox, tape: AgentLog) -> None:
        self._lockstep = config.world.mode == "lockstep"
        self._agent, self._arrivals, self._tape = agent, arrivals, tape
        self._state_key = STATE.key(config.team.name, agent.robot)
        self._after = {r.tick - r.passed - 1: r.tick for r in tape.records.values()}
        self._lost = _lost_records(tape.records, agent.robot)
        self._claimed = {
            found for r in tape.records.values() for text in r.taken if (found := referred(text))
        }
        self._queues = {source: sorted(heard) for source, heard in tape.heard.items()}
        self._due: dict[Source, Order] = {}  # in lock-step: up to where all has been awaited

    def steps(self) -> Iterator[Fed]:
        """Every step up to the agent's last command."""
        tick = self._next(-1)
        while tick <= self._tape.last:
            yield self._step(tick)
            tick = self._next(tick)

    def _next(self, tick: int) -> int:
        return self._after.get(tick, tick + 1)

    def _step(self, tick: int) -> Fed:
        record = self._tape.records.get(tick)
        missing = list(self._lost.get(tick, ()))
        state = self._state(tick)  # first: it says what time it is, see `Inbox`
        awaited = self._agent.awaited(tick) if self._lockstep else NOTHING
        wanted = [] if awaited == NOTHING else self._arrivals.wanted(tick, awaited)
        if record is not None:
            missing += self._take_listed(record)
            self._pass(wanted)
        else:
            for source, due in wanted:
                missing += self._take_up_to(source, due)
        if state is None:
            missing.append(f"state of {self._agent.robot} at tick {tick}")
            return Fed(tick, None, tuple(missing))
        return Fed(tick, self._arrivals.inputs(state, awaited), tuple(missing))

    def _state(self, tick: int) -> State | None:
        """The first valid state of a tick: the agent would not have stepped at a second one."""
        for payload in self._tape.states.pop(tick, ()):
            self._arrivals.take(self._state_key, payload)
            state = self._arrivals.state()
            if state is not None:
                return state
        return None

    def _take_listed(self, record: Consumed) -> list[str]:
        """Hand over what a record lists; what of it is not there."""
        missing = []
        for text in record.taken:
            found = referred(text)
            heard = self._tape.heard.get(found[0], {}) if found else {}
            packets = heard.get(found[1]) if found else None
            if packets:
                self._arrivals.take(*packets.pop(0))
            else:
                missing.append(text)
        return missing

    def _pass(self, wanted: list[Wanted]) -> None:
        """What was awaited at a step with a record and is in no record, the agent never got."""
        for source, due in wanted:
            queue = self._queues.get(source, [])
            while queue and queue[0] <= due:
                queue.pop(0)
            self._due[source] = due

    def _take_up_to(self, source: Source, due: Order) -> list[str]:
        """Hand over what is due by the rules of lock-step; what of it is not there."""
        queue, heard = self._queues.get(source, []), self._tape.heard.get(source, {})
        missing = self._missing_samples(source, due) + ([] if due in heard else [due])
        while queue and queue[0] <= due:
            order = queue.pop(0)
            if expected(source, order) and (source, order) not in self._claimed:
                for packet in heard[order]:
                    self._arrivals.take(*packet)
        self._due[source] = due
        return [reference_to(source, order) for order in missing]

    def _missing_samples(self, source: Source, due: Order) -> list[Order]:
        """A peer's samples before the last one, at ticks at which it gave a command."""
        topic, peer = source
        if topic != MEASUREMENT.name:
            return []
        before, awake = self._due.get(source, _BEFORE), self._tape.peers_awake[peer]
        first = max(before[0], 0) // SAMPLE_MS * SAMPLE_MS + SAMPLE_MS
        ticks = range(first, due[0], SAMPLE_MS)
        heard = self._tape.heard.get(source, {})
        return [(tick, 0) for tick in ticks if tick in awake and (tick, 0) not in heard]


def _lost_records(records: dict[int, Consumed], robot: str) -> dict[int, tuple[str, ...]]:
    """Names of the records that the recording lacks, by the tick from which they might speak."""
    lost: dict[int, tuple[str, ...]] = {}
    expected, after = 0, -1
    for tick in sorted(records):
        number = records[tick].number
        if number > expected:
            lost[after + 1] = (
                f"{number - expected} of {INPUTS.name} of {robot} between ticks {after} and {tick}",
            )
        expected, after = number + 1, tick
    return lost
