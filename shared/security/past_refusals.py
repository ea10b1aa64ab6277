"""What a router has refused so far: of each sender the newest kinds, for whoever asks."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, Final, NamedTuple

from quadriga.shared.printable import printable_line
from quadriga.shared.security.refusals import REASONS, Refused
from quadriga.shared.security.roll import split_common_name

_MOST_EACH: Final = 6  # kinds of one sender
_MOST: Final = 60  # kinds in all: the answer must fit into one message
_LONGEST: Final = 100  # characters of a text: an unusual key must not fill the answer
_MOST_TIMES: Final = 1 << 62  # that one thing was refused
_OLDEST: Final = 1e9  # s since the last time: as long as no router runs


class PastRefusal(NamedTuple):
    """One kind of refusal, and when.

    Attributes:
        refused: who was refused what.
        times: how many so far.
        age: since the last time, s.
    """

    refused: Refused
    times: int
    age: float


class RefusalMemory:
    """Remembers refusals: one thread notes them, another asks."""

    def __init__(self) -> None:
        self._kinds: dict[Refused, tuple[int, float]] = {}  # count, and when; the newest last
        self._shown: tuple[tuple[Refused, tuple[int, float]], ...] = ()

    def note(self, refused: Refused, count: int, now: float) -> None:
        """Something was refused `count` times until `now`, s of any clock."""
        who, action, key, reason = (text[:_LONGEST] for text in refused)
        kind = Refused(who, action, key, reason)
        before, _ = self._kinds.pop(kind, (0, now))
        self._kinds[kind] = before + count, now
        own = [each for each in self._kinds if each.who == who]
        if len(own) > _MOST_EACH:
            del self._kinds[own[0]]
        if len(self._kinds) > _MOST:
            del self._kinds[next(iter(self._kinds))]
        self._shown = tuple(self._kinds.items())

    def entries(self, now: float) -> tuple[str, ...]:
        """All that is remembered, as a `Refusals` message has it, the newest last."""
        return tuple(
            json.dumps([*kind, count, round(now - last, 3)]) for kind, (count, last) in self._shown
        )


def read_entries(entries: Iterable[str]) -> tuple[PastRefusal, ...]:
    """What a router has answered; entries that are none are left out."""
    return tuple(found for entry in entries if (found := _read(entry)) is not None)


def _read(entry: str) -> PastRefusal | None:
    try:
        given: Any = json.loads(entry)
    except (ValueError, RecursionError):
        return None
    if not isinstance(given, list) or [type(item) for item in given[:5]] != [str] * 4 + [int]:
        return None
    if len(given) != 6 or type(given[5]) not in (int, float) or given[3] not in REASONS:
        return None
    times, age = given[4:]
    if not (0 <= times < _MOST_TIMES and abs(age) < _OLDEST):
        return None
    who, action, key, reason = (printable_line(text) for text in given[:4])
    return PastRefusal(Refused(who, action, key, reason), times, float(age))


def refusals_of(identity: str, past: Iterable[PastRefusal]) -> tuple[PastRefusal, ...]:
    """Those of the certificates of one identity, the newest last."""
    return tuple(each for each in past if split_common_name(each.refused.who)[0] == identity)
