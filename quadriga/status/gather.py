"""Folds the messages of a team into a reading: pure, given when each of them came."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.recordings.late_commands import late_shares
from quadriga.recordings.rates import RateFigures, Rates
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.members import LEADS
from quadriga.shared.messages import Event, Message, Status, format_event
from quadriga.shared.recording.reader import ChunkEntry
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import CLOCK, STATUS, find_topic
from quadriga.status.record import Account, Costs, TeamReading

_EVENTS: Final = 5  # that are remembered
_MS: Final = 1e-6  # of a nanosecond


@dataclass(slots=True)
class _Told:
    """The newest status of one process, and all that it said it cost since the last look."""

    status: Status
    at_ns: int
    planner_ms: list[Array]
    tick_us: list[Array]


class StatusFold:
    """What has been heard of a team; between two looks it goes on counting.

    Args:
        config: the team's configuration.
    """

    def __init__(self, config: Config) -> None:
        self._team = config.team.name
        self._rates = Rates(config)
        self._told: dict[str, _Told] = {}
        self._events: deque[str] = deque(maxlen=_EVENTS)
        self._counted: dict[str, dict[str, int]] = {}  # by plant, at the last look
        self._shares: dict[str, float] = {}  # of late commands: a plant reports once a second
        self._lost: dict[str, int] = {}  # by key, until the last look
        self._time = -1, 0  # the newest tick and when it came, ns
        self._time_before = -1, 0  # at the last look

    def add(self, key: str, payload: bytes, tick: int, at_ns: int) -> None:
        """One message.

        Args:
            key: on which it came.
            payload: as received.
            tick: that it carries; −1: none that can be read.
            at_ns: when it came, by a steady clock.
        """
        self._rates.add(ChunkEntry(key, tick, at_ns, payload))
        topic, _ = find_topic(key)
        if topic is None:
            return
        if topic is CLOCK and tick > self._time[0]:
            self._time = tick, at_ns
        if topic.type not in (Status, Event):
            return
        try:
            message: Message = decode(payload, topic.type)
        except MessageError:
            return  # its rate counts, what it says does not
        if isinstance(message, Event):
            self._events.append(format_event(message))
        elif isinstance(message, Status) and topic is STATUS:
            self._note(key.split("/")[1], message, at_ns)

    def _note(self, name: str, status: Status, at_ns: int) -> None:
        before = self._told.get(name)
        planner_ms = [] if before is None else before.planner_ms
        tick_us = [] if before is None else before.tick_us
        planner_ms.append(status.planner_ms)
        tick_us.append(status.tick_us)
        self._told[name] = _Told(status, at_ns, planner_ms, tick_us)

    def look(self, now_ns: int) -> TeamReading:
        """What was heard since the last look; costs, late commands and rates begin anew."""
        accounts = {name: _account_of(told, now_ns) for name, told in self._told.items()}
        tick, _ = self._time
        pace, topics, late = self._pace(), self._rates.figures(), self._late()
        lost = self._lost_lately(topics)
        reading = TeamReading(tick, pace, accounts, topics, lost, late, tuple(self._events))
        self._rates.restart()
        self._time_before = self._time
        for name, told in self._told.items():
            self._told[name] = _Told(told.status, told.at_ns, [], [])
        return reading

    def _lost_lately(self, topics: Sequence[RateFigures]) -> dict[str, int]:
        """By key the messages that were lost between the last look and this one."""
        lost = {of.key: max(0, of.lost - self._lost.get(of.key, 0)) for of in topics}
        self._lost = {of.key: of.lost for of in topics}
        return {key: count for key, count in lost.items() if count}

    def _pace(self) -> float | None:
        """World time per wall time between the ticks that were newest at this look and the last."""
        (tick, at_ns), (tick_before, before_ns) = self._time, self._time_before
        if tick_before < 0 or at_ns <= before_ns:
            return None
        return (tick - tick_before) / (_MS * (at_ns - before_ns))

    def _late(self) -> dict[str, float]:
        """By robot the share of late commands between the two newest reports of its plant."""
        for name, told in self._told.items():
            if name not in LEADS and not name.startswith("plant_"):
                continue
            now = dict(told.status.counters)
            self._shares |= late_shares(self._counted.get(name, {}), now)
            self._counted[name] = now
        return dict(self._shares)


def _account_of(told: _Told, now_ns: int) -> Account:
    status = told.status
    return Account(
        status.mode,
        status.reason,
        _MS * (now_ns - told.at_ns),
        dict(status.ages_ms),
        _costs_of(told.planner_ms),
        _costs_of(told.tick_us),
        dict(status.counters),
    )


def _costs_of(parts: Sequence[Array]) -> Costs | None:
    values = np.concatenate(parts) if parts else np.zeros(0)
    if not len(values):
        return None
    return Costs(float(np.median(values)), float(np.quantile(values, 0.99)), float(np.max(values)))
