"""What went over a plant link, gathered for whoever records or looks on: batches of some ticks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.codec import MAX_TICK, decode, encode_rows
from quadriga.shared.errors import MessageError
from quadriga.shared.link.packets import COMMAND_SIZE, STATE_SIZE
from quadriga.shared.members import SIM, plant_name
from quadriga.shared.messages import Command, State, Ticks
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import COMMAND, STATE, Topic

_BEFORE: Final = 3  # numbers in front of a row: the robot, its tick, and when
_LONGEST_NS: Final = 10**15  # of a batch: it is sent after some ms


class LinkMessage(NamedTuple):
    """A state or a command out of a batch.

    Attributes:
        log_ns: when it was sent, or taken in, ns since 1970.
        topic: `STATE` or `COMMAND`.
        robot: its robot's name.
        key: under which it is known.
        tick: its own.
        payload: the message as `encode` writes it.
    """

    log_ns: int
    topic: Topic
    robot: str
    key: str
    tick: int
    payload: bytes


class TickBatch:
    """Rows that are gathered until they are sent. They are kept, not copied.

    Args:
        robots: whose they are.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        self._robots = tuple(robots)
        self._place = {name: place for place, name in enumerate(robots)}
        self._states, self._commands = list[_Item](), list[_Item]()

    def add_state(self, robot: str, tick: int, row: Array, at: int) -> None:
        """Gather a state that was sent at a time of `clock.log_ns`."""
        self._states.append((self._place[robot], tick, at, row))

    def add_command(self, robot: str, tick: int, row: Array, at: int) -> None:
        """Gather a command that was taken in then."""
        self._commands.append((self._place[robot], tick, at, row))

    def take(self, tick: int) -> Ticks | None:
        """All that was gathered, as a message, oldest first; None of nothing."""
        firsts = [items[0][2] for items in (self._states, self._commands) if items]
        if not firsts:
            return None
        begun = min(firsts)
        rows = _rows(self._states, begun, STATE_SIZE), _rows(self._commands, begun, COMMAND_SIZE)
        self._states, self._commands = [], []
        return Ticks(tick, tick * 1_000_000, begun, self._robots, *rows)


_Item = tuple[int, int, int, Array]  # place of the robot, tick, when, row


def _rows(items: Sequence[_Item], begun: int, size: int) -> Array:
    rows = np.empty((len(items), _BEFORE + size))
    if items:
        rows[:, :_BEFORE] = [(place, tick, at - begun) for place, tick, at, _ in items]
        rows[:, _BEFORE:] = [row for *_, row in items]
    return rows


def gathered(key: str, payload: bytes) -> list[LinkMessage]:
    """The states and commands of a batch, oldest first; none of what is no batch, or no row.

    `key` is that of the batch: an agent, or the plant of one robot, speaks for that robot alone.
    """
    try:
        ticks = decode(payload, Ticks)
    except MessageError:
        return []
    team, sender, _ = key.split("/")
    if sender != SIM and any(sender not in (name, plant_name(name)) for name in ticks.robots):
        return []
    found, most = list[LinkMessage](), (len(ticks.robots) - 1, MAX_TICK - 1, _LONGEST_NS)
    for topic, kind, given in (STATE, State, ticks.states), (COMMAND, Command, ticks.commands):
        valid = (given[:, :_BEFORE] >= 0) & (given[:, :_BEFORE] <= most)
        rows = given if valid.all() else given[valid.all(axis=1)]
        heads = rows[:, :_BEFORE].astype(np.int64).tolist()
        keys = [topic.key(team, robot) for robot in ticks.robots]
        payloads = encode_rows(kind, [tick for _, tick, _ in heads], rows[:, _BEFORE:])
        found += [
            LinkMessage(ticks.begun_ns + after, topic, ticks.robots[place], keys[place], tick, sent)
            for (place, tick, after), sent in zip(heads, payloads, strict=True)
        ]
    found.sort(key=_time_of)
    return found


def _time_of(message: LinkMessage) -> int:
    return message.log_ns
