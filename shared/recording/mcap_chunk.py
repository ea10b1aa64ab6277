"""Reading the inside of an MCAP chunk: channels, schemas and messages of this project."""

from __future__ import annotations

import json
import struct
from collections.abc import Container, Iterator
from io import BytesIO
from typing import Final, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from quadriga.shared.recording.seal import newer_format_error
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.topics import TABLE, find_topic

RECORD: Final = struct.Struct("<BQ")  # opcode, length
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
            yield ChunkEntry(key, -1 if head is None else head[0], log_time, payload)
        at = end


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
