"""Packets of the plant link: a header of fixed size, then one row of float64, or a text.

Little-endian. The header is version, kind and robot, then tick and stamp of the row, and a digest
of what the rows of this version hold, so that none is read by who means other fields.

| offset | type | |
|---|---|---|
| 0 | uint16 | version |
| 2 | uint8 | kind |
| 3 | uint8 | the robot, 0-based in the team's order |
| 4 | uint32 | 0 |
| 8 | int64 | tick, ms of world time |
| 16 | int64 | stamp, ns of world time |
| 24 | 8 bytes | digest of the layout |
| 32 | float64 … | the row of a state or a command; of the other kinds UTF-8 |
"""

from __future__ import annotations

import struct
from dataclasses import fields
from hashlib import sha256
from typing import Final

import numpy as np

from quadriga.shared.messages import Command, Flat, State
from quadriga.shared.printable import printable_line
from quadriga.shared.robots.conventions import Array

VERSION: Final = 1
HELLO, WELCOME, REFUSED, STATE, COMMAND, END = range(1, 7)  # kinds
HEADER: Final = struct.Struct("<HBBIqq8s")
TEXT_MOST: Final = 512  # bytes of a text
_WHEN: Final = struct.Struct("<qq")
_WHEN_AT: Final = 8
STATE_SIZE: Final = State.SIZE
COMMAND_SIZE: Final = Command.SIZE
_SIZES: Final = {STATE: HEADER.size + 8 * STATE_SIZE, COMMAND: HEADER.size + 8 * COMMAND_SIZE}
MOST: Final = HEADER.size + max(8 * STATE_SIZE, 8 * COMMAND_SIZE, TEXT_MOST)


def _form(kind: type[Flat]) -> list[tuple[str, ...]]:
    return [(f.name, *map(str, f.metadata.get("shape", ()))) for f in fields(kind)]


LAYOUT: Final = sha256(repr((_form(State), _form(Command))).encode()).digest()[:8]


class RowPacket:
    """A packet that is filled again and again: its row is a view of the bytes that are sent.

    Attributes:
        view: all of its bytes.
        row: its numbers.
    """

    def __init__(self, kind: int, robot: int, size: int) -> None:
        memory = bytearray(HEADER.size + 8 * size)
        HEADER.pack_into(memory, 0, VERSION, kind, robot, 0, 0, 0, LAYOUT)
        self.view = memoryview(memory)
        self.row: Array = np.frombuffer(memory, np.float64, size, HEADER.size)

    def stamp(self, tick: int, stamp_ns: int) -> memoryview:
        """The bytes to send, once `row` is filled, as of a tick."""
        _WHEN.pack_into(self.view, _WHEN_AT, tick, stamp_ns)
        return self.view


class PacketBuffer:
    """Where packets are received.

    Attributes:
        view: all bytes that there is room for.
        state, command: the row of what was received, if it is one of these.
        kind, robot, tick, stamp_ns: of what was received, once it is parsed.
    """

    def __init__(self) -> None:
        memory = bytearray(MOST)
        self.view = memoryview(memory)
        self.state: Array = np.frombuffer(memory, np.float64, STATE_SIZE, HEADER.size)
        self.command: Array = np.frombuffer(memory, np.float64, COMMAND_SIZE, HEADER.size)
        self.kind = self.robot = self.tick = self.stamp_ns = 0

    def parse(self, size: int) -> str:
        """Read the header of a packet of `size` bytes; why it is none, "" if it is one."""
        head = HEADER.unpack_from(self.view)
        version, self.kind, self.robot, _, self.tick, self.stamp_ns, layout = head
        if version == VERSION and layout == LAYOUT and size == _SIZES.get(self.kind):
            return ""
        return fault_of(self.view[:size])

    def text(self, size: int) -> str:
        """The text of a packet of `size` bytes, fit for a terminal."""
        return printable_line(self.view[HEADER.size : size].tobytes().decode("utf-8", "replace"))


def text_packet(kind: int, robot: int = 0, text: str = "") -> bytes:
    """A packet with a text of at most `TEXT_MOST` bytes."""
    head = HEADER.pack(VERSION, kind, robot, 0, 0, 0, LAYOUT)
    return head + text.encode("utf-8", "replace")[:TEXT_MOST]


def fault_of(packet: bytes | memoryview) -> str:
    """Why bytes are no packet of this version and layout; "": they are one."""
    if len(packet) < HEADER.size:
        return f"{len(packet)} bytes, expected at least {HEADER.size}"
    version, kind, *_, layout = HEADER.unpack_from(packet)
    if version != VERSION:
        return f"version {version} of the plant link, expected {VERSION}"
    if layout != LAYOUT:
        return f"states and commands of layout {layout.hex()}, expected {LAYOUT.hex()}"
    if len(packet) != _SIZES.get(kind, len(packet)):
        return f"{len(packet)} bytes, expected {_SIZES[kind]}"
    return "" if HELLO <= kind <= END else f"kind {kind}, expected {HELLO} … {END}"
