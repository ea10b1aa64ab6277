"""An event as a line of its author's log, for people, and for whom the bus did not reach."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

from quadriga.shared.printable import printable_line
from quadriga.shared.wire.codes import EVENTS
from quadriga.shared.wire.messages import Event

_LINE: Final = re.compile(r"(\d+) ms: (\S+) (\S*) (.*)")


def format_event(event: Event) -> str:
    """The line of an event: its tick, its code, the robot concerned or nothing, and its detail."""
    return printable_line(f"{event.tick} ms: {event.code} {event.robot} {event.detail}")


def parse_events(lines: Iterable[str]) -> Iterator[Event]:
    """The events of a log; lines that are none are left out."""
    for line in lines:
        match = _LINE.fullmatch(line.rstrip("\n"))
        if match is not None and match[2] in EVENTS:
            yield Event.of(int(match[1]), match[2], match[3], match[4])
