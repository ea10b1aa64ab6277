"""Writing the MCAP container: LZ4 chunks with their indexes, and the summary at the end.

The library's own writer spends several times as long on each message; this one leaves the hot
path to `struct` and everything else to the library's records.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from typing import BinaryIO, Final

import lz4.frame
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_MESSAGE_FIELDS: Final = 22  # bytes of a message record's content before the payload
_INDEX_HEAD: Final = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries


class McapFile:
    """An MCAP file under construction on an open binary file, which stays the caller's.

    Schemas, channels and messages gather in the open chunk, which is closed when it exceeds
    `chunk_size` bytes or on `flush`.
    """

    def __init__(self, file: BinaryIO, chunk_size: int, profile: str, library: str) -> None:
        self._file, self._chunk_size = file, chunk_size
        self._parts: list[bytes] = []  # of the open chunk
        self._size = 0  # bytes in it
        self._entries: defaultdict[int, list[int]] = defaultdict(list)  # log time, offset, …
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: defaultdict[int, int] = defaultdict(int)  # messages by channel
        file.write(MCAP0_MAGIC)
        file.write(_bytes(Header(profile, library)))

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """Write a metadata record, ahead of the open chunk."""
        record, offset = _bytes(Metadata(name, values)), self._file.tell()
        self._file.write(record)
        self._metadata.append(MetadataIndex(offset, len(record), name))

    def schema(self, name: str, text: str) -> int:
        """Register a JSON schema and return its id."""
        record = Schema(len(self._schemas) + 1, text.encode(), "jsonschema", name)
        self._schemas.append(record)
        self._append(_bytes(record))
        return len(self._schemas)

    def channel(self, topic: str, encoding: str, schema: int) -> int:
        """Register a channel and return its id."""
        record = Channel(len(self._channels) + 1, topic, encoding, {}, schema)
        self._channels.append(record)
        self._append(_bytes(record))
        return len(self._channels)

    def message(
        self, channel: int, sequence: int, log_time: int, publish_time: int, payload: bytes
    ) -> None:
        """Append a message; times in ns."""
        self._entries[channel] += (log_time, self._size)
        length = _MESSAGE_FIELDS + len(payload)
        head = _MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_time, publish_time)
        self._parts += (head, payload)
        self._size += len(head) + len(payload)
        if self._size > self._chunk_size:
            self._close_chunk()

    def flush(self) -> None:
        """Close the open chunk and hand everything to the operating system."""
        self._close_chunk()
        self._file.flush()

    def finish(self) -> None:
        """Close the open chunk and write the summary section."""
        self._close_chunk()
        self._file.write(_bytes(DataEnd(0)))
        start, offsets = self._file.tell(), []
        groups = (
            (Opcode.SCHEMA, self._schemas), (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]), (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, self._metadata),
        )  # fmt: skip
        for opcode, records in groups:
            begin = self._file.tell()
            self._file.write(b"".join(_bytes(record) for record in records))
            offsets.append(SummaryOffset(opcode, begin, self._file.tell() - begin))
        offset_start = self._file.tell()
        self._file.write(b"".join(_bytes(record) for record in offsets))
        self._file.write(_bytes(Footer(start, offset_start, 0)))
        self._file.write(MCAP0_MAGIC)

    def _append(self, record: bytes) -> None:
        self._parts.append(record)
        self._size += len(record)

    def _close_chunk(self) -> None:
        if not self._entries:
            return
        content = b"".join(self._parts)
        packed: bytes = lz4.frame.compress(content)
        times = [time for entries in self._entries.values() for time in entries[::2]]
        first, last = min(times), max(times)
        chunk = _bytes(Chunk("lz4", packed, last, first, zlib.crc32(content), len(content)))
        offset = self._file.tell()
        self._file.write(chunk)
        index_offset, at = self._file.tell(), {}
        for channel, entries in self._entries.items():
            at[channel] = self._file.tell()
            self._counts[channel] += len(entries) // 2
            size = 8 * len(entries)
            self._file.write(_INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size))
            self._file.write(struct.pack(f"<{len(entries)}Q", *entries))
        self._chunks.append(
            ChunkIndex(
                chunk_length=len(chunk), chunk_start_offset=offset, compression="lz4",
                compressed_size=len(packed), message_end_time=last,
                message_index_length=self._file.tell() - index_offset, message_index_offsets=at,
                message_start_time=first, uncompressed_size=len(content),
            )
        )  # fmt: skip
        self._parts, self._size = [], 0
        self._entries.clear()

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0, channel_count=len(self._channels),
            channel_message_counts=dict(self._counts), chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            metadata_count=len(self._metadata), schema_count=len(self._schemas),
        )  # fmt: skip


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    content: bytes = builder.end()
    return content
