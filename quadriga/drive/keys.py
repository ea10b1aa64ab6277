"""Driving by single keys of a terminal, which tells of no key that it is let go of: pure.

So a key changes what is asked for, and it stays asked for until another key changes it, for as long
as the program runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final, NamedTuple

from quadriga.drive.driver_words import ESTOP, STAND, TAKE
from quadriga.drive.wish import Wish, limit

_REST, _STEER, _QUIT = "rest", "steer", "quit"
_STEPS: Final = MappingProxyType(
    {
        "forward": ("vx", 0.1),
        "back": ("vx", -0.1),
        "left": ("vy", 0.1),
        "right": ("vy", -0.1),
        "turn left": ("wz", 0.2),
        "turn right": ("wz", -0.2),
        "up": ("height", 0.01),
        "down": ("height", -0.01),
    }
)
KEYS: Final[Mapping[bytes, str]] = MappingProxyType(
    {
        b"\x1b[A": "forward",
        b"\x1bOA": "forward",
        b"w": "forward",
        b"\x1b[B": "back",
        b"\x1bOB": "back",
        b"s": "back",
        b"\x1b[D": "turn left",
        b"\x1bOD": "turn left",
        b"a": "turn left",
        b"\x1b[C": "turn right",
        b"\x1bOC": "turn right",
        b"d": "turn right",
        b"q": "left",
        b"e": "right",
        b"r": "up",
        b"f": "down",
        b"x": _REST,
        b" ": STAND,
        b"\n": TAKE,
        b"\r": TAKE,
        b"k": ESTOP,
        b"\x04": _QUIT,
    }
)
HELP: Final = (
    "Enter take the controls · w s forward, back · a d turn · q e sideways · r f height · "
    "x all to 0 · space stand · k STOP: damp every joint · Ctrl-D leave"
)


class Keys(NamedTuple):
    """What has come of the keys so far.

    Attributes:
        wish: what is asked for.
        held: whether it counts; else the team stands.
        word: what is to be said now, of `quadriga.drive.driver_words`; "" nothing.
        over: whether the driver leaves.
    """

    wish: Wish
    held: bool = False
    word: str = ""
    over: bool = False


def press(before: Keys, key: str, rest: Wish) -> Keys:
    """What comes of one key.

    Args:
        before: what had come of those before it.
        key: its meaning, of `KEYS`; "": none was pressed.
        rest: to stand with.
    """
    if key in _STEPS:
        name, step = _STEPS[key]
        wish = replace(before.wish, **{name: round(getattr(before.wish, name) + step, 3)})
        return Keys(limit(wish), before.held)
    if key == TAKE:
        return Keys(rest, held=True, word=TAKE)
    if key == _REST:
        return Keys(rest, before.held)
    if key in (STAND, ESTOP):
        return Keys(rest, held=False, word=ESTOP if key == ESTOP else "")
    return Keys(before.wish, before.held, over=key == _QUIT)
