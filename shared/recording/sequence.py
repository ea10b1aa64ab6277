"""The ticks of one key: since when it is there, and which messages are missing between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

_JUMP: Final = 600_000  # ms: a longer jump is another clock or a forged tick, not a loss
_LONG: Final = 10_000  # ms: so long a jump, or one back, is believed if the next message follows it
_KEPT: Final = 1000  # gaps that are remembered one by one

Gap = tuple[int, int]  # last tick before it, first tick after it


class TickTrack:
    """The ticks of one key, followed message by message.

    Attributes:
        count: messages.
        first, last: ticks of the first and the newest message, −1 before them; one out of order,
            or far ahead, counts as the newest once the next message goes on from it.
        lost: messages that are missing between them, by the topic's period, without those that
            are known not to have been sent.
        gaps: where, at most the first thousand.
    """

    __slots__ = ("_odd", "_period", "count", "first", "gaps", "last", "lost")

    def __init__(self, period: int, before: int = -1) -> None:
        """Begin to follow.

        Args:
            period: world time between two messages, ms; 0: none is missed.
            before: tick of the message before the first one here, −1 if unknown.
        """
        self._period, self.last = period, before
        self._odd = -1  # tick that no message has confirmed yet
        self.first = -1
        self.count = self.lost = 0
        self.gaps: list[Gap] = []

    def note(self, tick: int) -> None:
        """A message has come; a negative tick stands for one that could not be read."""
        self.count += 1
        if tick < 0:
            return
        if self.first < 0:
            self.first = tick
        if self.last < 0 or self._period == 0 or 0 <= tick - self.last < _LONG:
            self._go_on(tick)
        elif self._odd >= 0 and 0 < tick - self._odd <= self._period:
            self._go_on(self._odd)
            self._go_on(tick)
        else:
            self._odd = tick

    def pass_over(self, count: int) -> None:
        """Of the missing messages `count` were never sent, so they are not lost."""
        self.lost = max(0, self.lost - count)

    def _go_on(self, tick: int) -> None:
        step = tick - self.last
        counted = self._period > 0 and self.last >= 0
        if counted and self._period < step < _JUMP:
            missing = (step - 1) // self._period
            self.lost += missing
            if missing and len(self.gaps) < _KEPT:
                self.gaps.append((self.last, tick))
        self.last, self._odd = tick, -1


def lost_by_key(tracks: Mapping[str, TickTrack]) -> dict[str, int]:
    """Missing messages of the keys that miss some."""
    return {key: track.lost for key, track in sorted(tracks.items()) if track.lost}
