"""Which messages of a key are missing by their ticks, and which were never sent."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Final

from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Consumed
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import COMMAND, INPUTS

_JUMP: Final = 600_000  # ms: a longer jump is another clock or a forged tick, not a loss
_KEPT: Final = 1000  # gaps that are remembered one by one

Gap = tuple[int, int]  # last tick before it, first tick after it


class TickTrack:
    """The ticks of one key, followed message by message.

    Attributes:
        count: messages.
        first, last: ticks of the first message and of the newest one, −1 before them; a message
            that is older than the one before it, or by far newer, is not taken for the newest.
        lost: messages that are missing between them, by the topic's period, without those that
            are known not to have been sent.
        gaps: where, at most the first thousand.
    """

    __slots__ = ("_missing", "_period", "_skipped", "count", "first", "gaps", "last")

    def __init__(self, period: int, before: int = -1) -> None:
        """Begin to follow.

        Args:
            period: world time between two messages, ms; 0: none is missed.
            before: tick of the message before the first one here, −1 if unknown.
        """
        self._period, self.last = period, before
        self.first = -1
        self.count = self._missing = self._skipped = 0
        self.gaps: list[Gap] = []

    def note(self, tick: int) -> None:
        """A message has come; a negative tick stands for one that could not be read."""
        self.count += 1
        if tick < 0:
            return
        if self.first < 0:
            self.first = tick
        if self.last >= 0 and self._period > 0:
            step = tick - self.last
            if not 0 < step < _JUMP:
                return
            missing = (step - 1) // self._period
            self._missing += missing
            if missing and len(self.gaps) < _KEPT:
                self.gaps.append((self.last, tick))
        self.last = tick

    def skip(self, count: int) -> None:
        """Of the missing messages `count` were never sent, so they are not lost.

        That may be known before they are missed.
        """
        self._skipped += count

    @property
    def lost(self) -> int:
        """See the class."""
        return max(0, self._missing - self._skipped)


def lost_by_key(tracks: Mapping[str, TickTrack]) -> dict[str, int]:
    """Missing messages of the keys that miss some."""
    return {key: track.lost for key, track in sorted(tracks.items()) if track.lost}


class SkippedTicks:
    """Finds in a team's messages which ticks agents that are late in real time have skipped.

    They send no command then, and none is lost. In lock-step an agent has to answer every tick.
    """

    def __init__(self, config: Config) -> None:
        team = config.team.name
        names = robot_names(config.team.robots) if config.world.mode == "realtime" else ()
        self._commands = {INPUTS.key(team, name): COMMAND.key(team, name) for name in names}

    def find(self, key: str, payload: bytes) -> tuple[str, int] | None:
        """Key of the commands that an agent says it did not send, and how many of them.

        None of a message that says nothing about it, or that none was skipped.
        """
        if key in self._commands:
            with suppress(MessageError):
                passed = decode(payload, Consumed).passed
                return (self._commands[key], passed) if passed > 0 else None
        return None
