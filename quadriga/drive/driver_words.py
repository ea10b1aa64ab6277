"""What a driver says to the operator: JSON texts of a few words, checked before they count."""

from __future__ import annotations

import json
import math
from typing import Any, Final

from quadriga.drive.wish import NAMES, Wish, limit
from quadriga.shared.errors import MessageError
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.record import record

# Words, and what each stands for.
TAKE: Final = "take"  # take the controls
RELEASE: Final = "release"  # give them back
DRIVE: Final = "drive"  # what is asked for now, ten times a second or more
STAND: Final = "stand"  # all slow down and stand
GO_ON: Final = "go-on"  # robots that stand, and may, walk again
ESTOP: Final = "estop"  # damp every joint
RESET: Final = "reset"  # release that, by name
NEWS: Final = "news"  # asks who drives and what the robots do
WHERE: Final = "where"  # asks where the page is
KINDS: Final = frozenset((TAKE, RELEASE, DRIVE, STAND, GO_ON, ESTOP, RESET, NEWS, WHERE))

MOST_BYTES: Final = 1024
_LONGEST_TEXT: Final = 200  # characters


@record
class DriverWord:
    """One thing a driver says.

    Attributes:
        kind: one of `KINDS`.
        wish: of `DRIVE`, within the limits; else None.
        held: of `DRIVE`: whether the dead man's switch is held.
        text: of an emergency stop why, of a release by whom.
        number: of the driver's own count; it comes back with what answers it.
    """

    kind: str
    wish: Wish | None = None
    held: bool = False
    text: str = ""
    number: int = 0


def read_driver_word(payload: str | bytes) -> DriverWord:
    """What a text says.

    Raises:
        MessageError: it is none of these words, or a number in it is none.
    """
    if len(payload) > MOST_BYTES:
        raise _wrong(f"{len(payload)} bytes", f"at most {MOST_BYTES}")
    try:
        body: Any = json.loads(payload)
    except (ValueError, RecursionError) as error:
        raise _wrong(str(error)[:80], "a JSON object") from None
    if not isinstance(body, dict):
        raise _wrong(type(body).__name__, "a JSON object")
    kind, number, text = body.get("kind"), body.get("number", 0), body.get("text", "")
    if not isinstance(kind, str) or kind not in KINDS:
        raise _wrong(f"kind {kind!r}"[:80], f"one of {', '.join(sorted(KINDS))}")
    if type(number) is not int or not 0 <= number < 1 << 53:
        raise _wrong(f"number {number!r}"[:80], "an integer ≥ 0 and below 2^53")
    if not isinstance(text, str):
        raise _wrong(f"text {type(text).__name__}", "text")
    said = DriverWord(kind, text=printable_line(text)[:_LONGEST_TEXT], number=number)
    if kind != DRIVE:
        return said
    return DriverWord(kind, _read_wish(body), body.get("held") is True, said.text, number)


def _read_wish(body: dict[str, Any]) -> Wish:
    return limit(Wish(*(_read_number(body.get(name), name) for name in NAMES)))


def _read_number(value: Any, name: str) -> float:
    try:
        number = float(value) if type(value) in (int, float) else math.nan
    except OverflowError:  # an integer beyond all floating-point numbers
        number = math.inf
    if not math.isfinite(number):
        raise _wrong(f"{name} {value!r}"[:80], "a finite number")
    return number


def _wrong(got: str, expected: str) -> MessageError:
    return MessageError("what a driver says", got, expected)
