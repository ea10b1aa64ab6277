"""A refusal as a line of a router's log, for people, and for who counts what a recorder missed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from quadriga.shared.printable import printable_line

_LINE: Final = re.compile(r"refused: (.+?): (.*) \(([a-z]+), (\d+) times\)")


class AuditLine(NamedTuple):
    """What a router has refused of one sender since it told so last.

    Attributes:
        who: common name of the sender's certificate, or where it came from.
        what: the action and the key concerned.
        reason: as of the message `Refusal`.
        times: how often.
    """

    who: str
    what: str
    reason: str
    times: int


def format_refusal(line: AuditLine) -> str:
    """The line of the log."""
    what = printable_line(line.what)
    return f"refused: {printable_line(line.who)}: {what} ({line.reason}, {line.times} times)"


def parse_refusals(lines: Iterable[str]) -> Iterator[AuditLine]:
    """The refusals of a log; lines that are none are left out."""
    for line in lines:
        match = _LINE.fullmatch(line.rstrip("\n"))
        if match is not None:
            yield AuditLine(match[1], match[2], match[3], int(match[4]))
