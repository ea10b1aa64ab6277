"""The lives of a recorded agent: it may have been started again while its team walked.

Each of its processes knew nothing of the one before, so each is replayed from its own beginning.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Final

from quadriga.replay.agent_log import AgentLog
from quadriga.shared.wire.messages import Consumed
from quadriga.shared.wire.topics import COMMAND

_NEVER: Final = 1 << 62  # ms


def split_lives(log: AgentLog) -> tuple[AgentLog, ...]:
    """What a recording holds of each process of an agent, in their order.

    What all of them have sent stays together in each log, and so does what they may have taken in:
    their records tell which of them it was.
    """
    again = list(_find_begins(log.records))
    if not again:
        return (log,)
    return tuple(_cut(log, begin, end) for begin, end in pairwise([-1, *again, _NEVER]))


def first_tick(log: AgentLog) -> int:
    """Tick of the first step of a life."""
    return min(log.states, default=-1)


def _find_begins(records: Mapping[int, Consumed]) -> Iterator[int]:
    """First ticks of all lives but the first: each process counts its records from 0."""
    number = -1
    for tick in sorted(records):
        if records[tick].number <= number:
            yield tick
        number = records[tick].number


def _cut(log: AgentLog, begin: int, end: int) -> AgentLog:
    """The part of a log from a tick on, up to another one."""
    states = {tick: found for tick, found in log.states.items() if begin <= tick < end}
    records = {tick: record for tick, record in log.records.items() if begin <= tick < end}
    commands = [tick for name, tick, _ in log.sent if name == COMMAND.name and begin <= tick < end]
    last = min(log.last, max([*commands, *records], default=-1))
    return replace(log, states=states, records=records, last=last)
