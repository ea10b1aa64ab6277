"""Bytes made of good ones: noise, cut, torn, twice over, flipped bits, extreme numbers."""

from __future__ import annotations

import struct
from typing import Final

import numpy as np

_EXTREMES: Final = (
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x00",
    b"\x7f\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\xdd\xff\xff\xff\xff",
    b"\xdf\xff\xff\xff\xff",
    b"\xc6\xff\xff\xff\xff",
    b"\x91" * 3000,
    b"\x81\xa1a" * 1500,
    b"[" * 3000,
    b"{" * 3000,
    b"9" * 5000,
    b"\x1b[2J",
    b"\xed\xa0\x80",
    b"\n",
    struct.pack("<d", float("nan")),
    struct.pack("<d", float("inf")),
    struct.pack("<d", 1e300),
    struct.pack("<Q", (1 << 64) - 1),
    struct.pack("<Q", 1 << 41),
    struct.pack("<d", -1e39),
)


def damage(good: bytes, random: np.random.Generator) -> bytes:
    """Something else than `good`, most often like it."""
    content = bytearray(good)
    for _ in range(1 + int(random.exponential(0.7))):
        _hurt(content, random)
    return bytes(content)


def _hurt(content: bytearray, random: np.random.Generator) -> None:
    """One damage, in place."""
    size = len(content)
    if not size:
        content += random.bytes(8)
        return
    at, kind = int(random.integers(size)), int(random.integers(8))
    until = min(size, at + int(random.integers(1, 64)))
    if kind < 3:
        content[at] ^= 1 << int(random.integers(8))
    elif kind == 3:
        del content[at:]
    elif kind == 4:
        content[at:until] = random.bytes(until - at)
    elif kind == 5:
        del content[at:until]
    elif kind == 6:
        extreme = _EXTREMES[int(random.integers(len(_EXTREMES)))]
        keeps_size = bool(random.integers(2))
        content[at : at + len(extreme) * keeps_size] = extreme
    else:
        content[at:at] = content[int(random.integers(size)) :][:4096]
