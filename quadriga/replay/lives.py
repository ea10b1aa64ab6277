"""The lives of a recorded agent: it may have been started again while its team walked.

Each of its processes knew nothing of the one before, so each is replayed from its own beginning.
One that was killed may have taken in, before its last commands, what it could not tell any more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Final

from quadriga.replay.agent_log import AgentLog
from quadriga.shared.messages import Consumed
from quadriga.shared.topics import COMMAND

_NEVER: Final = 1 << 62  # ms
_OUTLIVED_MS: Final = 1000  # of states after its last command: a process that did not see the end


def split_lives(log: AgentLog, *, paced: bool, whole: bool) -> tuple[AgentLog, ...]:
    """What a recording holds of each process of an agent, in their order.

    What all of them have sent stays together in each log, and so does what they may have taken in:
    their records tell which of them it was.

    Args:
        log: of the agent.
        paced: whether the team walked in real time: in lock-step rules tell what was taken in.
        whole: whether the recording goes on to the end of the walk.
    """
    again = list(_find_begins(log.records))
    lives = [log]
    if again:
        lives = [_cut(log, begin, end) for begin, end in pairwise([-1, *again, _NEVER])]
    saw_end = whole and max(log.states, default=-1) - log.last <= _OUTLIVED_MS
    if paced:
        ended = len(lives) - saw_end
        lives[:ended] = [replace(life, told=max(life.records)) for life in lives[:ended]]
    return tuple(lives)


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
