"""The remote control of A1, Go1 and Go2, as it is in every packet that a robot sends."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cache
from typing import Final

from quadriga.shared.errors import ConfigError
from quadriga.shared.unitree.packets import REMOTE_BYTES

BUTTONS: Final = (
    "R1",
    "L1",
    "start",
    "select",
    "R2",
    "L2",
    "F1",
    "F2",
    "A",
    "B",
    "X",
    "Y",
    "up",
    "right",
    "down",
    "left",
)
_KEYS: Final = struct.Struct("<2xH")
_STICKS: Final = struct.Struct("<5f")  # lx, rx, ry, L2, ly
_STICKS_AT: Final = 4


@dataclass(frozen=True, slots=True)
class RemoteReading:
    """What the remote control says.

    Attributes:
        on: whether it says anything: of one that is off all bytes are zero.
        pressed: names of the buttons that are down, of `BUTTONS`.
        lx, ly, rx, ry: of the sticks, −1 … 1, right and up positive; what is no number is 0.
    """

    on: bool
    pressed: frozenset[str]
    lx: float = 0.0
    ly: float = 0.0
    rx: float = 0.0
    ry: float = 0.0


def read_remote(packet: bytes) -> RemoteReading:
    """The reading of the 40 bytes of a report; any bytes have one."""
    (keys,) = _KEYS.unpack_from(packet)
    lx, rx, ry, _, ly = (_within(stick) for stick in _STICKS.unpack_from(packet, _STICKS_AT))
    pressed = frozenset(name for bit, name in enumerate(BUTTONS) if keys >> bit & 1)
    return RemoteReading(any(packet), pressed, lx, ly, rx, ry)


def are_pressed(packet: bytes, buttons: frozenset[str]) -> bool:
    """Whether all these buttons are down in the 40 bytes of a report, and perhaps others."""
    (keys,) = _KEYS.unpack_from(packet)
    wanted = _bits(buttons)
    return bool(keys & wanted == wanted)


@cache
def _bits(buttons: frozenset[str]) -> int:
    return sum(1 << bit for bit, name in enumerate(BUTTONS) if name in buttons)


def write_remote(reading: RemoteReading) -> bytes:
    """The 40 bytes of a reading, as a robot would send them."""
    packet = bytearray(REMOTE_BYTES)
    if not reading.on:
        return bytes(packet)
    packet[:2] = b"\x55\x51"
    struct.pack_into("<H", packet, 2, _bits(reading.pressed))
    _STICKS.pack_into(packet, _STICKS_AT, reading.lx, reading.rx, reading.ry, 0.0, reading.ly)
    return bytes(packet)


def parse_buttons(text: str, name: str) -> frozenset[str]:
    """Buttons that are pressed together, as `L2+B`.

    Args:
        text: their names with `+` between them.
        name: of the key that has the text, for the error.

    Raises:
        ConfigError: there is no such button.
    """
    buttons = frozenset(part.strip() for part in text.split("+"))
    unknown = sorted(buttons.difference(BUTTONS))
    if unknown:
        raise ConfigError(name, repr(text), f"buttons of {', '.join(BUTTONS)}, joined by +")
    return buttons


def _within(stick: float) -> float:
    return min(1.0, max(-1.0, stick)) if stick == stick else 0.0
