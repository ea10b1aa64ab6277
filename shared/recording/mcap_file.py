"""Writing the MCAP container: LZ4 chunks with their indexes, and the summary at the end.

The library's own writer spends several times as long on each message; this one leaves the hot
path to `struct` and everything else to the library's records.

Every chunk repeats the channels, up to 16 KiB of them, so that it can be read whatever became of
those before it; chunks, data section and summary carry checksums, so that no flipped bit goes
unnoticed.
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
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.recording.packed_records import PackedRecords

_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_MESSAGE_FIELDS: Final = 22  # bytes of a message record's content before the payload
_FOOTER: Final = struct.Struct("<BQQQ")  # opcode, length, summary, offsets; a checksum follows
_ENTRY: Final = 24  # bytes that a message takes in the index, with its share of what is around it
_REPEATED: Final = 16384  # bytes of channels that a chunk repeats: those of ten robots and others
_INDEX_HEAD: Final = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries


class McapFile:
    """An MCAP file under construction on an open binary file, which stays the caller's.

    Schemas, channels and messages gather in the open chunk, which is closed when it exceeds
    `chunk_size` bytes or on `flush`.
    """

    def __init__(self, file: BinaryIO, chunk_size: int, profile: str, library: str) -> None:
        self._file, self._chunk_size = file, chunk_size
        self._written = self._crc = 0  # bytes so far, and their checksum
        self._known = b""  # the channels' records, for each chunk
        self._parts: list[bytes] = []  # of the open chunk
        self._size = 0  # bytes in it
        self._waiting = 0  # bytes of its indexes
        self._entries: defaultdict[int, list[int]] = defaultdict(list)  # log time, offset, …
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks = PackedRecords()  # their indexes
        self._index_size = 0  # bytes of schemas and channels in the summary
        self._times: list[int] = []  # earliest and latest log time
        self._metadata: list[MetadataIndex] = []
        self._counts: defaultdict[int, int] = defaultdict(int)  # messages by channel
        self._write(MCAP0_MAGIC)
        self._write(_bytes(Header(profile, library)))

    @property
    def size(self) -> int:
        """Bytes written, waiting (the open chunk before compression) and of the index to come."""
        index = self._index_size + self._chunks.size
        return self._written + self._size + self._waiting + index

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """Write a metadata record, ahead of the open chunk."""
        record, offset = _bytes(Metadata(name, values)), self._written
        self._write(record)
        self._metadata.append(MetadataIndex(offset, len(record), name))

    def schema(self, name: str, text: str) -> int:
        """Register a JSON schema and return its id."""
        record = Schema(len(self._schemas) + 1, text.encode(), "jsonschema", name)
        self._schemas.append(record)
        self._append(_bytes(record))
        self._index_size += len(_bytes(record))
        return len(self._schemas)

    def channel(self, topic: str, encoding: str, schema: int) -> int:
        """Register a channel and return its id."""
        record = Channel(len(self._channels) + 1, topic, encoding, {}, schema)
        self._channels.append(record)
        content = _bytes(record)
        self._append(content)
        self._index_size += len(content)
        if len(self._known) + len(content) <= _REPEATED:
            self._known += content
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
        self._waiting += _ENTRY
        if self._size > self._chunk_size:
            self._close_chunk()

    def flush(self) -> None:
        """Close the open chunk and hand everything to the operating system."""
        self._close_chunk()
        self._file.flush()

    def finish(self) -> None:
        """Close the open chunk and write the summary section."""
        self._close_chunk()
        self._write(_bytes(DataEnd(self._crc)))
        start, offsets, self._crc = self._written, [], 0
        groups = (
            (Opcode.SCHEMA, map(_bytes, self._schemas)),
            (Opcode.CHANNEL, map(_bytes, self._channels)),
            (Opcode.STATISTICS, [_bytes(self._statistics())]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, map(_bytes, self._metadata)),
        )
        for opcode, records in groups:
            begin = self._written
            self._write(b"".join(records))
            offsets.append(SummaryOffset(opcode, begin, self._written - begin))
        offset_start = self._written
        self._write(b"".join(_bytes(record) for record in offsets))
        self._write(_FOOTER.pack(Opcode.FOOTER, _FOOTER.size - 9 + 4, start, offset_start))
        self._write(self._crc.to_bytes(4, "little"))
        self._write(MCAP0_MAGIC)

    def _write(self, content: bytes) -> None:
        self._file.write(content)
        self._written += len(content)
        self._crc = zlib.crc32(content, self._crc)

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
        offset = self._written
        self._write(chunk)
        index_offset, at = self._written, {}
        for channel, entries in self._entries.items():
            at[channel] = self._written
            self._counts[channel] += len(entries) // 2
            size = 8 * len(entries)
            self._write(_INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size))
            self._write(struct.pack(f"<{len(entries)}Q", *entries))
        index = ChunkIndex(
            chunk_length=len(chunk),
            chunk_start_offset=offset,
            compression="lz4",
            compressed_size=len(packed),
            message_end_time=last,
            message_index_length=self._written - index_offset,
            message_index_offsets=at,
            message_start_time=first,
            uncompressed_size=len(content),
        )
        self._chunks.append(_bytes(index))
        self._times = [min([first, *self._times[:1]]), max([last, *self._times[1:]])]
        self._parts, self._size, self._waiting = [self._known], len(self._known), 0
        self._entries.clear()

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=self._chunks.count,
            message_count=sum(self._counts.values()),
            message_end_time=self._times[1] if self._times else 0,
            message_start_time=self._times[0] if self._times else 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    content: bytes = builder.end()
    return content
