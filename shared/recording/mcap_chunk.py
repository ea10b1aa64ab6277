"""Reading the inside of an MCAP chunk: channels, schemas and messages of this project."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Container, Iterator, Mapping
from io import BytesIO
from types import MappingProxyType
from typing import Final, NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema

from quadriga.shared.recording.seal import newer_format_error
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.topics import TABLE, find_topic

RECORD: Final = struct.Struct("<BQ")  # opcode, length
BARE: Final = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)  # in chunks, and outside of any
_LATEST: Final = (1 << 63) - 1  # ns: what MCAP has 64 bits for, tables have 63 and a sign
LARGEST_CHUNK: Final = 1 << 27  # bytes unpacked; `recorder.chunk_kib` is half of that at most

# What the MCAP library, LZ4 and Zstandard raise on bytes that are no record.
CORRUPT: Final = (
    McapError, struct.error, ValueError, RuntimeError, IndexError, EOFError, MemoryError,
    OverflowError, zstandard.ZstdError,
)  # fmt: skip

_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_KNOWN: Final = {f"quadriga.{topic.type.__name__}": topic.type.SCHEMA for topic in TABLE}


class ChunkEntry(NamedTuple):
    """One recorded message.

    `tick` is -1 where the message carries none that can be read.
    """

    key: str
    tick: int
    log_time_ns: int
    payload: bytes


def stream(content: bytes) -> ReadDataStream:
    """The content of a record for the MCAP library."""
    return ReadDataStream(BytesIO(content))


def messages_of(
    chunk: bytes,
    wanted: dict[int, str | None],
    path: str,
    names: Container[str] | None = None,
    keys: Container[str] | None = None,
) -> Iterator[ChunkEntry]:
    """Entries of one chunk.

    Args:
        chunk: its records, uncompressed.
        wanted: keys by channel, None for one that is not wanted; learns them as they pass by.
        path: the file's, for the error.
        names: of topics that are wanted; None: all, also of keys outside the table.
        keys: that are wanted; None: all.

    Raises:
        RecordingError: the messages are of a schema later than this version's.
    """
    at = 0
    while at < len(chunk):
        if chunk[at] != Opcode.MESSAGE:
            opcode, length = RECORD.unpack_from(chunk, at)
            at += RECORD.size
            if opcode == Opcode.CHANNEL:
                channel_id = int.from_bytes(chunk[at : at + 2], "little")
                if channel_id not in wanted:  # every chunk repeats them
                    topic = Channel.read(stream(chunk[at : at + length])).topic
                    wanted[channel_id] = _wanted_key(topic, names, keys)
            elif opcode == Opcode.SCHEMA:
                check_schema(Schema.read(stream(chunk[at : at + length])), path)
            at += length
            continue
        _, length, channel_id, _, log_time, _ = _MESSAGE.unpack_from(chunk, at)
        key = wanted.get(channel_id)
        end = at + RECORD.size + length
        if key is not None:
            payload = chunk[at + _MESSAGE.size : end]
            head = envelope(payload)
            tick = -1 if head is None else head[0]
            yield ChunkEntry(key, tick, min(log_time, _LATEST), payload)
        at = end


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
    _check_size(size)
    decompressor = lz4.frame.LZ4FrameDecompressor()
    content: bytes = decompressor.decompress(packed, max_length=size + 1)
    return _checked(content, size)


def _unpack_zstd(packed: bytes, size: int) -> bytes:
    """See `UNPACK`."""
    _check_size(size)
    stated = zstandard.frame_content_size(packed)
    if stated not in (size, -1):  # else as much would be allocated as the frame says
        raise ValueError(f"a frame of {stated} bytes in a chunk of {size}")
    content = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    return _checked(content, size)


def _check_size(size: int) -> None:
    if size > LARGEST_CHUNK:
        raise ValueError(f"{size} bytes unpacked, at most {LARGEST_CHUNK} are read")


def _checked(content: bytes, size: int) -> bytes:
    if len(content) != size:
        raise ValueError(f"{len(content)} bytes where {size} were packed")
    return content


# By the name of the packing: from packed bytes and the size that the chunk states to as many bytes,
# or one of CORRUPT. No more than the stated size is ever allocated.
UNPACK: Final[Mapping[str, Callable[[bytes, int], bytes]]] = MappingProxyType(
    {"lz4": _unpack_lz4, "zstd": _unpack_zstd}
)


def check_schema(schema: Schema, path: str) -> None:
    """Raise RecordingError if a schema is later than this version's."""
    mine = _KNOWN.get(schema.name)
    if mine is None:
        return
    try:
        version = json.loads(schema.data)["properties"]["schema"]["const"]
    except (ValueError, TypeError, LookupError, RecursionError):
        return
    if isinstance(version, int) and version > mine:
        raise newer_format_error(
            path, f"messages {schema.name} of schema {version}", f"schema {mine}"
        )


def name_of(key: str) -> str:
    """Name of a key's topic, "" if the table has none."""
    topic, _ = find_topic(key)
    return "" if topic is None else topic.name


def _wanted_key(key: str, names: Container[str] | None, keys: Container[str] | None) -> str | None:
    """The key, None if it is not wanted."""
    named = names is None or name_of(key) in names
    return key if named and (keys is None or key in keys) else None
