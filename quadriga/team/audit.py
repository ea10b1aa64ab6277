"""What a router has refused: told to who reads its output, to the recording, and to who asks."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping
from queue import SimpleQueue
from typing import Final

from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.bus.zenoh_log import ZenohLog
from quadriga.shared.members import ROUTER
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.security.audit_line import AuditLine, format_refusal
from quadriga.shared.security.past_refusals import RefusalMemory
from quadriga.shared.security.refusals import (
    DENIED,
    LEVELS,
    MARKERS,
    REVOKED,
    RefusalParser,
    Refused,
)
from quadriga.shared.security.roll import split_common_name
from quadriga.shared.wire.about import REFUSALS, Refusals
from quadriga.shared.wire.codec import encode, truncate_text
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.messages import Refusal
from quadriga.shared.wire.topics import CLOCK, REFUSED

_MOST: Final = 20  # refusals that are told at once; a flood of keys must not flood us
_LONGEST: Final = 200  # characters of a key


class RefusalLog:
    """What Zenoh has refused since this was made, as it comes from its log."""

    def __init__(self) -> None:
        """Begin; from now on nothing may be printed to the standard output."""
        self._parser = RefusalParser()
        self._found: SimpleQueue[Counter[Refused]] = SimpleQueue()
        self._log = ZenohLog(LEVELS, MARKERS, self._take)

    def take(self) -> Counter[Refused]:
        """What has come since the last call."""
        found: Counter[Refused] = Counter()
        while not self._found.empty():
            found += self._found.get_nowait()
        return found

    def _take(self, lines: list[str]) -> None:
        found = self._parser.take(lines)
        if found:
            self._found.put(found)


def condense(found: Counter[Refused]) -> list[tuple[Refused, int]]:
    """What is told of refusals: the most frequent as they are, the keys of the rest in one.

    So who hides behind another's many keys is named, too. Of more than 20 such senders, who have
    sessions of their own, the rest is only counted.
    """
    kinds = found.most_common()
    of_sender: dict[Refused, Counter[str]] = {}
    for refused, count in kinds[_MOST:]:
        of_sender.setdefault(refused._replace(key=""), Counter())[refused.key] += count
    rest = [
        (sender._replace(key=f"{len(keys)} more keys"), keys.total())
        for sender, keys in of_sender.items()
    ]
    return kinds[:_MOST] + sorted(rest, key=lambda told: -told[1])[:_MOST]


class Audit:
    """Tells what a router refuses.

    Args:
        bus: the router's.
        log: where refusals come from.
        revoked: by identity the number of the last certificate that is not valid any more.
    """

    def __init__(self, bus: Bus, log: RefusalLog, revoked: Mapping[str, int]) -> None:
        self._log, self._revoked = log, revoked
        self._names: dict[str, str] = {}  # by session
        self._tick = self._stamp_ns = 0
        self._memory = RefusalMemory()
        bus.watch_links(self._note_link)
        self._clock = bus.collect(CLOCK.key(bus.team))
        self._put = bus.publisher(REFUSED.key(bus.team), droppable=True)
        bus.answer(REFUSALS.key(bus.team, ROUTER), self._answer)

    def tell(self) -> list[Refused]:
        """Tell all that has been refused since the last call, and return it."""
        self._follow_clock()
        found: Counter[Refused] = Counter()
        for refused, count in self._log.take().items():
            found[self._name_sender(refused)] += count
        told = condense(found)
        for refused, count in told:
            self._memory.note(refused, count, monotonic())
            self._tell(refused, count)
        untold = found.total() - sum(count for _, count in told)
        if untold:
            print(f"refused: {untold} times of more senders", file=sys.stderr, flush=True)
        return list(found)

    def _tell(self, refused: Refused, count: int) -> None:
        key = truncate_text(printable_line(refused.key), _LONGEST)
        who, action, reason = refused.who, refused.action, refused.reason
        line = AuditLine(who, f"{action} {key}".rstrip(), reason, count)
        print(format_refusal(line), file=sys.stderr, flush=True)
        self._put(encode(Refusal(self._tick, self._stamp_ns, who, action, key, reason, count)))

    def _answer(self) -> bytes:
        return encode(Refusals(self._tick, self._stamp_ns, self._memory.entries(monotonic())))

    def _follow_clock(self) -> None:
        arrivals = self._clock()
        head = envelope(arrivals[-1][2]) if arrivals else None
        if head is not None:
            self._tick, self._stamp_ns = head

    def _name_sender(self, refused: Refused) -> Refused:
        """With the common name of the sender's certificate, and whether that is revoked."""
        who = self._name(refused.who)
        identity, number = split_common_name(who)
        revoked = 0 < number <= self._revoked.get(identity, 0)
        reason = REVOKED if revoked and refused.reason == DENIED else refused.reason
        return refused._replace(who=who, reason=reason)

    def _name(self, session: str) -> str:
        """The name that goes with a session or its beginning; what is no session stays."""
        known = self._names.get(session)
        if known is not None:
            return known
        return next((n for s, n in self._names.items() if s.startswith(session)), session)

    def _note_link(self, session: str, name: str) -> None:
        self._names[session] = name
