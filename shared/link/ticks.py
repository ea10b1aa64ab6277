"""What went over a plant link, gathered for whoever records or looks on: batches of some ticks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.codec import MAX_INTEGER, MAX_TICK, decode, encode_rows
from quadriga.shared.errors import MessageError
from quadriga.shared.link.packets import COMMAND_SIZE, STATE_SIZE
from quadriga.shared.members import SIM, plant_name
from quadriga.shared.messages import Command, State, Ticks
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import COMMAND, STATE, Topic

_BEFORE: Final = 3  # numbers in front of a row: the robot, its tick, and when
_LONGEST_NS: Final = 10**15  # of a batch: it is sent after some ms
_PER_TICK: Final = 4  # rows of a robot in a tick that there is room for; more are sent at once


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
    """Rows that are gathered until they are sent.

    Args:
        robots: whose they are.
        ticks: for how many there is room.
    """

    def __init__(self, robots: Sequence[str], ticks: int) -> None:
        self._robots = tuple(robots)
        self._place = {name: place for place, name in enumerate(robots)}
        room = _PER_TICK * len(robots) * ticks
        self._states, self._commands = _RowBuffer(room, STATE_SIZE), _RowBuffer(room, COMMAND_SIZE)

    def add_state(self, robot: str, tick: int, row: Array, at: int) -> None:
        """Gather a state that was sent at a time of `clock.log_ns`."""
        self._states.add((self._place[robot], tick, at), row)

    def add_command(self, robot: str, tick: int, row: Array, at: int) -> None:
        """Gather a command that was taken in then."""
        self._commands.add((self._place[robot], tick, at), row)

    @property
    def is_full(self) -> bool:
        """Whether there may be no room for another tick."""
        n = len(self._robots)
        return self._states.room < n or self._commands.room < _PER_TICK * n

    def take(self, tick: int) -> Ticks | None:
        """All that was gathered, as a message; None of nothing."""
        begun = min(self._states.begun, self._commands.begun)
        states, commands = self._states.take(begun), self._commands.take(begun)
        if not (len(states) or len(commands)):
            return None
        return Ticks(tick, tick * 1_000_000, begun, self._robots, states, commands)


class _RowBuffer:
    """Rows of numbers, what stands before each apart until all are taken."""

    def __init__(self, most: int, size: int) -> None:
        self._rows = np.empty((most, _BEFORE + size))
        self._heads = list[tuple[int, int, int]]()

    @property
    def room(self) -> int:
        return len(self._rows) - len(self._heads)

    @property
    def begun(self) -> int:
        """When the first was; no time of `clock.log_ns` is as late as that of none."""
        return self._heads[0][2] if self._heads else MAX_INTEGER - 1

    def add(self, head: tuple[int, int, int], row: Array) -> None:
        if not self.room:  # of an agent that answers much at once
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[len(self._heads), _BEFORE:] = row
        self._heads.append(head)

    def take(self, begun: int) -> Array:
        """Those that were added, of which nothing is left: the next ones take their place."""
        rows = self._rows[: len(self._heads)]
        if self._heads:
            rows[:, :_BEFORE] = [(place, tick, at - begun) for place, tick, at in self._heads]
            self._heads.clear()
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
