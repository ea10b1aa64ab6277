"""How often messages of each key come, and how far they are behind the newest of all."""

from __future__ import annotations

from collections.abc import Sequence
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
        told: whether nobody listens to the key, and a process tells how many there were: then
            `per_s` is over the time between its last accounts, `behind_ms` is not known, and
            `silent_s` is since the last account.
    """

    key: str
    per_s: float
    behind_ms: int | None
    silent_s: float | None
    told: bool = False


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


@dataclass(slots=True)
class _ToldCount:
    """Messages of one key by somebody's accounts: how many since one, and when the newest came."""

    messages: int = 0
    since: float | None = None
    came: float | None = None

    def row(self, key: str, now: float) -> KeyTraffic:
        """What is reported at `now`."""
        since, came = self.since, self.came
        if since is None or came is None:
            return KeyTraffic(key, 0.0, None, None, told=True)
        per_s = self.messages / (came - since) if came > since else 0.0
        return KeyTraffic(key, per_s, None, now - came, told=True)

    def begin_anew(self) -> None:
        """Count from the newest account on."""
        self.messages, self.since = 0, self.came


class Traffic:
    """Counts by key; a new key is known from its first mention on, even if nothing has come."""

    def __init__(self, now: float) -> None:
        """Begin to count, `now` in seconds of a clock that never goes back."""
        self._counts: dict[str, _Count] = {}
        self._told: dict[str, _ToldCount] = {}
        self._order: list[str] = []
        self._since = now

    def note(self, key: str, count: int, tick: int, now: float) -> None:
        """`count` more messages of a key; `tick` is that of the newest, unless negative."""
        known = self._counts.get(key)
        if known is None:
            known = self._counts[key] = _Count()
            self._order.append(key)
        if count:
            known.messages += count
            known.tick, known.came = max(known.tick, tick), now

    def note_told(self, key: str, counts: Sequence[int], now: float) -> None:
        """Accounts of a key that nobody listens to: in each, messages since the one before.

        The first account of all only begins the count: since when its messages were sent is not
        known.
        """
        known = self._told.get(key)
        if known is None:
            known = self._told[key] = _ToldCount()
            self._order.append(key)
        if not counts:
            return
        if known.since is None:
            known.since = now
        else:
            known.messages += sum(counts)
        known.came = now

    def report(self, now: float) -> tuple[KeyTraffic, ...]:
        """Rates since the last report, by key, in the order in which keys became known."""
        seconds = max(now - self._since, 1e-6)
        newest = max((count.tick for count in self._counts.values()), default=-1)
        rows = tuple(
            self._told[key].row(key, now)
            if key in self._told
            else self._counts[key].row(key, newest, seconds, now)
            for key in self._order
        )
        self._since = now
        for count in self._counts.values():
            count.messages = 0
        for told in self._told.values():
            told.begin_anew()
        return rows
