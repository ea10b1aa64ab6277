"""A gamepad of this machine, as Linux tells of it (joystick API): what it asks for. Pure.

Of an event: time in ms, value, kind, number; see linux/joystick.h.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from quadriga.drive.wish import Wish, limits
from quadriga.shared.runtime.record import record

EVENT_BYTES: Final = 8
_EVENT: Final = struct.Struct("<IhBB")
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_FULL: Final = 32767
_DEAD_ZONE: Final = 0.12
# Numbers of the kernel's drivers for pads of Sony, Microsoft and those that say they are these.
STOP_BUTTON: Final = 1  # B, or circle
HOLD_BUTTON: Final = 5  # right shoulder
TAKE_BUTTON: Final = 7  # start, or options
_LEFT_X, _LEFT_Y, _RIGHT_X = 0, 1, 3


@record
class Gamepad:
    """Its axes, −1 … 1 to the right and downward, and its buttons, by number."""

    axes: tuple[tuple[int, float], ...] = ()
    pressed: frozenset[int] = frozenset()


def take(pad: Gamepad, event: bytes) -> tuple[Gamepad, int]:
    """The gamepad after an event, and the button that has just been pressed; −1: none."""
    _, value, kind, number = _EVENT.unpack(event)
    if kind & ~_INITIAL == _AXIS:
        axes = {**dict(pad.axes), number: max(-1.0, value / _FULL)}
        return replace(pad, axes=tuple(sorted(axes.items()))), -1
    if kind & ~_INITIAL != _BUTTON:
        return pad, -1
    if value:
        news = -1 if kind & _INITIAL else number
        return replace(pad, pressed=pad.pressed | {number}), news
    return replace(pad, pressed=pad.pressed - {number}), -1


def wish_of(pad: Gamepad, rest: Wish) -> Wish:
    """What it asks for: the left stick forward and sideways, the right one turns."""
    axes: Mapping[int, float] = dict(pad.axes)
    return Wish(
        _scale("vx", -axes.get(_LEFT_Y, 0.0)),
        _scale("vy", -axes.get(_LEFT_X, 0.0)),
        _scale("wz", -axes.get(_RIGHT_X, 0.0)),
        rest.height,
    )


def _scale(name: str, share: float) -> float:
    """A share of what can be asked for; of a stick that is let go of exactly nothing."""
    low, high = limits()[name]
    if abs(share) < _DEAD_ZONE:
        return 0.0
    return share * high if share > 0.0 else -share * low
