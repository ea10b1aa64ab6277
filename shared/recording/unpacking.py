"""Unpacking the content of an MCAP chunk, whoever wrote it and whatever has happened to it."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

import lz4.frame
import zstandard
from mcap.exceptions import McapError
from mcap.records import Chunk

LARGEST_CHUNK: Final = 1 << 30  # bytes; no recorder writes such
_LZ4_RATIO: Final = 256  # LZ4 packs nothing better

# What the MCAP library, LZ4 and Zstandard raise on bytes that are no record.
CORRUPT: Final = (
    McapError, struct.error, ValueError, RuntimeError, IndexError, EOFError, MemoryError,
    OverflowError, zstandard.ZstdError,
)  # fmt: skip


def content_of(chunk: Chunk) -> bytes:
    """Content of a chunk.

    Raises:
        one of CORRUPT: it is damaged, or packed in another way than `UNPACK` knows.
    """
    if chunk.compression == "":
        content: bytes = chunk.data
    elif chunk.compression in UNPACK:
        content = UNPACK[chunk.compression](chunk.data, chunk.uncompressed_size)
    else:
        raise ValueError(f"packed with {chunk.compression[:16]!r}")
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise ValueError("its checksum is wrong")
    return content


def _unpack_lz4(packed: bytes, size: int) -> bytes:
    """See `UNPACK`."""
    _check_size(size, min(LARGEST_CHUNK, _LZ4_RATIO * (len(packed) + 1)))
    decompressor = lz4.frame.LZ4FrameDecompressor()
    content: bytes = decompressor.decompress(packed, max_length=size + 1)
    return _checked(content, size)


def _unpack_zstd(packed: bytes, size: int) -> bytes:
    """See `UNPACK`."""
    _check_size(size, LARGEST_CHUNK)
    stated = zstandard.frame_content_size(packed)
    if stated not in (size, -1):  # else as much would be allocated as the frame says
        raise ValueError(f"a frame of {stated} bytes in a chunk of {size}")
    content = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    return _checked(content, size)


def _check_size(size: int, most: int) -> None:
    if size > most:
        raise ValueError(f"{size} bytes that cannot be packed in so few")


def _checked(content: bytes, size: int) -> bytes:
    if len(content) != size:
        raise ValueError(f"{len(content)} bytes where {size} were packed")
    return content


# By the name of the packing: from packed bytes and the size that the chunk states to as many bytes,
# or one of CORRUPT. No more than the stated size is ever allocated.
UNPACK: Final[Mapping[str, Callable[[bytes, int], bytes]]] = MappingProxyType(
    {"lz4": _unpack_lz4, "zstd": _unpack_zstd}
)
