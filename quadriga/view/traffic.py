"""How often messages of each key come, and how far they are behind the newest of all."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class KeyTraffic:
    """Messages of one key.

    Attributes:
        key: without the team.
        per_s: messages per second of the wall clock, over the last second or so.
        behind_ms: world time of its newest message, less than that of the newest of all, ms; None
            if none has come yet.
        silent_s: since the newest came, s; None if none has come yet.
    """

    key: str
    per_s: float
    behind_ms: int | None
    silent_s: float | None


@dataclass(slots=True)
class _Count:
    """Messages of one key so far: how many, and when and of which tick the newest was."""

    messages: int = 0
    tick: int = -1
    came: float = 0.0

    def row(self, key: str, newest: int, seconds: float, now: float) -> KeyTraffic:
        """What is reported `seconds` after the last report; `newest` is the newest tick of all."""
        known = self.tick >= 0
        return KeyTraffic(
            key=key,
            per_s=self.messages / seconds,
            behind_ms=newest - self.tick if known else None,
            silent_s=now - self.came if known else None,
        )


class Traffic:
    """Counts by key; a new key is known from its first mention on, even if nothing has come."""

    def __init__(self, now: float) -> None:
        """Begin to count, `now` in seconds of a clock that never goes back."""
        self._counts: dict[str, _Count] = {}
        self._since = now

    def note(self, key: str, count: int, tick: int, now: float) -> None:
        """`count` more messages of a key; `tick` is that of the newest, unless negative."""
        known = self._counts.get(key)
        if known is None:
            known = self._counts[key] = _Count()
        if count:
            known.messages += count
            known.tick, known.came = max(known.tick, tick), now

    def report(self, now: float) -> tuple[KeyTraffic, ...]:
        """Rates since the last report, by key, in the order in which keys became known."""
        seconds = max(now - self._since, 1e-6)
        newest = max((count.tick for count in self._counts.values()), default=-1)
        rows = tuple(count.row(key, newest, seconds, now) for key, count in self._counts.items())
        self._since = now
        for count in self._counts.values():
            count.messages = 0
        return rows
