"""The check sum of Unitree's packets: CRC-32/MPEG-2 over little-endian words of four bytes.

Polynomial 0x04C11DB7, first 0xFFFFFFFF, neither reflected nor inverted at the end; each word counts
with its most significant byte first. zlib's CRC is the same with all bits mirrored.
"""

from __future__ import annotations

import zlib
from typing import Final

import numpy as np

_MIRRORED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_ALL_ONES: Final = 0xFFFFFFFF


def crc32(packet: bytes) -> int:
    """The check sum of the whole words of a packet; up to three bytes at its end do not count."""
    words = len(packet) // 4
    swapped = np.frombuffer(packet, ">u4", words).astype("<u4").tobytes()
    mirrored = zlib.crc32(swapped.translate(_MIRRORED)) ^ _ALL_ONES
    return int.from_bytes(mirrored.to_bytes(4, "little").translate(_MIRRORED), "big")
