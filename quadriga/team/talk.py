"""SHELL of a word that a person says to a team: who hears it, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final, Self

from quadriga.shared.bus.diagnostics import processes
from quadriga.shared.bus.session import HERE, POLL, Bus
from quadriga.shared.codec import decode, encode, envelope
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError, MessageError
from quadriga.shared.members import AGENT, SIM
from quadriga.shared.messages import Event, Message, Status
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import EVENT, STATUS, Topic, topics_for

SEARCH: Final = 5.0  # s, longest search for the team
_AGAIN, _OFTEN_FOR = 0.1, 1.0  # s: how often a word is said again at first, and for how long
_LATE: Final = 0.5  # s, in which a recorder finds this process, or it is not there
Say = Callable[[str], None]
"""Tells the person, in a line, what is done for them meanwhile."""
_MOST_EVENTS: Final = 10_000  # that are kept; more can only be a flood


def keep_quiet(_line: str) -> None:
    """Tell nobody what is done meanwhile."""


class TeamTalk:
    """A link to a team over which somebody says a word to it; a context.

    Args:
        config: the team's configuration.
        role: of this process on the bus.
        tell: is told what is done, as it may take a while.

    Attributes:
        agents: names of the team's robots.
        wanted: agents and plants, who are to hear the word.
        statuses: the newest status of each agent that has spoken.
        events: what the plants have announced.
        time: tick and stamp of the team's clock, as last heard; zeros before.
        tell: as given.

    Raises:
        BusError: the bus cannot be opened.
    """

    def __init__(self, config: Config, role: str, tell: Say = keep_quiet) -> None:
        team = config.team.name
        self.tell = tell
        tell(f"connecting to team {team!r} at {config.bus.endpoint}")
        self.agents = robot_names(config.team.robots)
        rows = processes(config)
        self.wanted = frozenset(row.name for row in rows if row.role.name in (AGENT, SIM))
        self.statuses: dict[str, Status] = {}
        self.events: list[Event] = []
        self.time = 0, 0
        self._members = frozenset(row.name for row in rows)
        self._repeat: Callable[[], None] | None = None
        self._told = frozenset[str]()
        self._again, self._until = 0.0, 0.0  # when it is due again, and until when it may be
        self.bus = Bus.open(config.bus, team, role)
        self._statuses = {STATUS.key(team, name): name for name in self.agents}
        for topic in topics_for(role):
            for key in self._statuses if topic is STATUS else (topic.key(team),):
                self.bus.subscribe(key)

    def publisher(self, topic: Topic) -> Callable[[Message], None]:
        """A function that says a word at once, whatever waits to be sent.

        It is said again, the same to the byte, while what comes of it is awaited: a few times, as a
        link that is new or under load may lose it, and to those of the team who turn up later, as a
        recorder that has not found this process yet must not miss what agents have heard.
        """
        put = self.bus.publisher(topic.key(self.bus.team), urgent=True)

        def say(message: Message) -> None:
            word = encode(message)
            self._repeat, self._told = lambda: put(word), self.bus.members_at(HERE)
            self._again, self._until = monotonic() + _AGAIN, monotonic() + _OFTEN_FOR
            put(word)

        return say

    def look(self, timeout: float = 0.0) -> frozenset[str]:
        """Which agents and plants hear this process now, after up to `timeout` seconds."""
        first = self.bus.get(timeout)
        for packet in (first, *self.bus.drain()) if first else ():
            self._take(*packet)
        here, now = self.bus.members_at(HERE), monotonic()
        is_due = bool((here - self._told) & self._members) or self._again <= now <= self._until
        if self._repeat is not None and is_due:
            self._told, self._again = self._told | here, now + _AGAIN
            self._repeat()
        return self.wanted & here

    def await_all(self, word: str) -> None:
        """Wait until all agents and plants hear this process, and the team's time is known.

        Args:
            word: what is to be said, for the error.

        Raises:
            BusError: some are not there within 5 s.
        """
        deadline = monotonic() + SEARCH
        while absent := self.wanted - self.look(POLL):
            if monotonic() > deadline:
                raise self.error(
                    word,
                    f"no {', '.join(sorted(absent))} on the bus after {SEARCH:g} s",
                    f"all of {', '.join(sorted(self.wanted))}",
                    "another bus.endpoint, team.name or team.robots? nobody was told",
                )
        while self.time == (0, 0):
            if monotonic() > deadline:
                raise self.error(
                    word, f"no time of the team within {SEARCH:g} s", "a team that walks", ""
                )
            self.look(POLL)

    def follow(self, is_done: Callable[[], bool], patience: float) -> bool:
        """Take in what comes until `is_done()`; False if it is not within `patience` seconds."""
        deadline = monotonic() + patience
        while not is_done():
            left = deadline - monotonic()
            if left <= 0.0:
                return False
            self.look(min(left, POLL))
        return True

    def all_are(self, *modes: str) -> bool:
        """Whether the newest status of every agent is one of these modes."""
        return all(
            name in self.statuses and self.statuses[name].mode in modes for name in self.agents
        )

    def describe(self) -> str:
        """What each robot does, by its newest status, one line each."""
        return "\n".join(f"{name}: {self._describe(name)}" for name in self.agents)

    def _describe(self, name: str) -> str:
        status = self.statuses.get(name)
        return "says nothing" if status is None else f"{status.mode} {status.reason}".rstrip()

    def _take(self, key: str, payload: bytes) -> None:
        self.time = envelope(payload) or self.time
        with suppress(MessageError):
            if key in self._statuses:
                self.statuses[self._statuses[key]] = decode(payload, Status)
            elif key == EVENT.key(self.bus.team) and len(self.events) < _MOST_EVENTS:
                self.events.append(decode(payload, Event))

    def error(self, word: str, got: str, expected: str, cause: str) -> BusError:
        """What went wrong with a word that was said, or was to be."""
        return BusError(f"{word} of team {self.bus.team!r}", got, expected, cause)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave, once all of the team have been told that may still turn up."""
        deadline = monotonic() + _LATE
        while self._repeat is not None and self._members - self._told and monotonic() < deadline:
            self.look(POLL)
        self._repeat = None
        self.bus.close()
