"""What went over a plant link, gathered for whoever records or looks on: batches of some ticks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.codec import MAX_TICK, decode
from quadriga.shared.errors import MessageError
from quadriga.shared.link.packets import COMMAND_SIZE, STATE_SIZE
from quadriga.shared.messages import Command, Flat, State, Ticks
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import COMMAND, STATE, Topic

_BEFORE: Final = 3  # numbers in front of a row: the robot, its tick, and when
_OLDEST: Final = 1e9  # s, of what is believed
_PER_TICK: Final = 4  # rows of a robot in a tick that there is room for; more are sent at once


class Gathered(NamedTuple):
    """A state or a command out of a batch.

    Attributes:
        topic: `STATE` or `COMMAND`.
        robot: its robot's name.
        message: itself.
        age: how long before the batch was sent it was, s.
    """

    topic: Topic
    robot: str
    message: Flat
    age: float

    def key(self, team: str) -> str:
        """The key under which it is known."""
        return self.topic.key(team, self.robot)


class TickBatch:
    """Rows that are gathered until they are sent.

    Args:
        robots: whose they are.
        ticks: for how many there is room.
        now: a steady clock, s.
    """

    def __init__(
        self, robots: Sequence[str], ticks: int, now: Callable[[], float] = monotonic
    ) -> None:
        self._robots, self._now = tuple(robots), now
        self._place = {name: place for place, name in enumerate(robots)}
        room = _PER_TICK * len(robots) * ticks
        self._states, self._commands = _Rows(room, STATE_SIZE), _Rows(room, COMMAND_SIZE)

    def add_state(self, robot: str, tick: int, row: Array, at: float) -> None:
        """Gather a state that was sent at a time of `now`."""
        self._states.add((self._place[robot], tick, at), row)

    def add_command(self, robot: str, tick: int, row: Array, at: float) -> None:
        """Gather a command that was taken in then."""
        self._commands.add((self._place[robot], tick, at), row)

    @property
    def is_full(self) -> bool:
        """Whether there may be no room for another tick."""
        n = len(self._robots)
        return self._states.room < n or self._commands.room < _PER_TICK * n

    def take(self, tick: int) -> Ticks | None:
        """All that was gathered, as a message that is sent now; None of nothing."""
        now = self._now()
        states, commands = self._states.take(now), self._commands.take(now)
        if not (len(states) or len(commands)):
            return None
        return Ticks(tick, tick * 1_000_000, self._robots, states, commands)


class _Rows:
    """Rows of numbers, what stands before each apart until all are taken."""

    def __init__(self, most: int, size: int) -> None:
        self._rows = np.empty((most, _BEFORE + size))
        self._heads = list[tuple[int, int, float]]()

    @property
    def room(self) -> int:
        return len(self._rows) - len(self._heads)

    def add(self, head: tuple[int, int, float], row: Array) -> None:
        if not self.room:  # of an agent that answers much at once
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[len(self._heads), _BEFORE:] = row
        self._heads.append(head)

    def take(self, now: float) -> Array:
        """Those that were added, of which nothing is left: the next ones take their place."""
        rows = self._rows[: len(self._heads)]
        if self._heads:
            rows[:, :_BEFORE] = self._heads
            rows[:, 2] = now - rows[:, 2]
            self._heads.clear()
        return rows


def gathered(payload: bytes) -> Iterator[Gathered]:
    """The states and commands of a batch, oldest first; nothing of what is none."""
    try:
        ticks = decode(payload, Ticks)
    except MessageError:
        return
    parts = (STATE, State, ticks.states), (COMMAND, Command, ticks.commands)
    most = len(ticks.robots) - 1, MAX_TICK - 1, _OLDEST
    found = [
        (*row[:_BEFORE].tolist(), topic, kind, row)
        for topic, kind, rows in parts
        for row in rows[((rows[:, :_BEFORE] >= 0) & (rows[:, :_BEFORE] <= most)).all(axis=1)]
    ]
    for robot, at, age, topic, kind, row in sorted(found, key=lambda item: -item[2]):
        tick = int(at)
        message = kind.from_row(tick, 1_000_000 * tick, row[_BEFORE:])
        yield Gathered(topic, ticks.robots[int(robot)], message, age)
