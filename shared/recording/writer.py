"""Writing MCAP recordings of all traffic.

The library's own writer takes 3.8 µs of a processor for each message, this one 1.0 µs: the hot path
is left to `struct` and everything else to the library's records. Every chunk repeats the channels,
up to 16 KiB of them, so that it can be read whatever became of those before it; chunks, data
section and summary carry checksums, so that no flipped bit goes unnoticed.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
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

from quadriga.shared.codec import envelope
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.recording.metadata import COUNTS, LOST, PROFILE, SINCE, seal
from quadriga.shared.recording.quota import Quota
from quadriga.shared.recording.ticks import TickTrack, lost_by_key
from quadriga.shared.schema import json_schema
from quadriga.shared.topics import TABLE, find_topic

_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_MESSAGE_FIELDS: Final = 22  # bytes of a message record's content before the payload
_FOOTER: Final = struct.Struct("<BQQQ")  # opcode, length, summary, offsets; a checksum follows
_ENTRY: Final = 24  # bytes that a message takes in the index, with its share of what is around it
_REPEATED: Final = 16384  # bytes of channels that a chunk repeats: those of ten robots and others
_INDEX_HEAD: Final = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries


class RecordingWriter:
    """Writes messages as sent: topic = key, log time = reception, publish time = world time.

    A message whose envelope cannot be read is written all the same, with its log time as
    publish time, and counted.

    Attributes:
        quota: what is not written, and how much of that there was.
        messages: how many were written.
        unreadable: how many of them carry no readable tick and stamp.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        chunk_kib: int = 256,
        *,
        periods: Mapping[str, int] | None = None,
        after: Mapping[str, int] | None = None,
        quota: Quota | None = None,
    ) -> None:
        """Create the file.

        Args:
            path: a file that does not exist yet; its folder is created.
            metadata: what the reader hands back: configuration, hashes, versions, team.
            chunk_kib: size of the chunks, KiB.
            periods: by a topic's name, ms between its messages, see
                `quadriga.shared.config.timing`; without them nothing is counted as lost.
            after: by key, tick of the last message in the file before this one.
            quota: what is written; by default all of the table of topics, and some of the rest.

        Raises:
            RecordingError: the file exists or cannot be created.
        """
        self.quota = quota or Quota()
        self.messages = self.unreadable = 0
        if path.exists():
            cause = "recordings are never overwritten"
            raise RecordingError(str(path), "a file that exists", "a new one", cause)
        with name_file_errors(RecordingError, path, "a writable folder"):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        self._mcap = McapFile(self._file, chunk_kib * 1024, PROFILE, "quadriga")
        self._metadata = seal(metadata)
        self._mcap.metadata(PROFILE, self._metadata)
        self._schemas = {
            topic.name: self._mcap.schema(
                f"{PROFILE}.{topic.type.__name__}",
                json.dumps(json_schema(topic.type), ensure_ascii=False),
            )
            for topic in TABLE
        }
        outside = '{"description":"a key outside the table of topics"}'
        self._unknown = self._mcap.schema(f"{PROFILE}.unknown", outside)
        self._end_size = 1024 + sum(len(k) + len(v) + 8 for k, v in self._metadata.items())
        self._channels: dict[str, tuple[int, TickTrack, bool]] = {}  # the last: of the team
        self._periods, self._after = periods or {}, after or {}
        self._file.flush()

    @property
    def size(self) -> int:
        """Bytes that the file will hardly exceed if it is finished now."""
        return self._mcap.size + self._end_size

    @property
    def tracks(self) -> dict[str, TickTrack]:
        """Ticks by key."""
        return {key: track for key, (_, track, _) in self._channels.items()}

    def write(self, key: str, payload: bytes, log_time_ns: int) -> None:
        """Append one message as sent; `log_time_ns` is its reception, see `clock.log_ns`."""
        row = self._channels.get(key)
        if row is None:
            if not self.quota.admits_key(key, len(self._channels)):
                return
            row = self._channels[key] = self._channel(key)
        channel, track, own = row
        if not self.quota.admits_payload(len(payload), own=own):
            return
        tick, publish_time = envelope(payload) or (-1, log_time_ns)
        if tick < 0:
            self.unreadable += 1
        self._mcap.message(channel, track.count, log_time_ns, publish_time, payload)
        track.note(tick)
        self.messages += 1

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Write down something about the recording, see `Recording.notes`."""
        self._mcap.metadata(name, dict(values))

    def flush(self) -> None:
        """Close the open chunk, so that what was written so far survives a kill.

        Raises:
            RecordingError: the file was deleted.
        """
        self._mcap.flush()
        if not os.fstat(self._file.fileno()).st_nlink:
            expected = "one that stays while the team walks"
            raise RecordingError(self._file.name, "a file that was deleted", expected)

    def finish(self) -> None:
        """Write counters and index and close the file; a second call does nothing.

        The metadata are repeated, should those at the file's beginning be damaged one day.
        """
        if self._file.closed:
            return
        tracks = self.tracks
        since = {key: track.first for key, track in sorted(tracks.items())}
        counts = {"messages": self.messages, "unreadable": self.unreadable}
        counts |= self.quota.refused
        with self._file:  # closed also if the disk is full
            self._mcap.flush()
            for name, values in ((COUNTS, counts), (LOST, lost_by_key(tracks)), (SINCE, since)):
                self._mcap.metadata(name, {key: str(value) for key, value in values.items()})
            self._mcap.metadata(PROFILE, self._metadata)
            self._mcap.finish()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.finish()

    def _channel(self, key: str) -> tuple[int, TickTrack, bool]:
        topic, _ = find_topic(key)
        if topic is None:
            name, schema, encoding = "", self._unknown, "application/octet-stream"
        else:
            name, schema, encoding = topic.name, self._schemas[topic.name], "msgpack"
        self._end_size += 2 * len(key) + 64  # of what is noted of it at the end
        track = TickTrack(self._periods.get(name, 0), self._after.get(key, -1))
        return self._mcap.channel(key, encoding, schema), track, self.quota.is_own(key)


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
        self._chunks: list[bytes] = []  # their indexes
        self._index_size = 0  # bytes of schemas, channels and indexes in the summary
        self._times: list[int] = []  # earliest and latest log time
        self._metadata: list[MetadataIndex] = []
        self._counts: defaultdict[int, int] = defaultdict(int)  # messages by channel
        self._write(MCAP0_MAGIC)
        self._write(_bytes(Header(profile, library)))

    @property
    def size(self) -> int:
        """Bytes written, waiting (the open chunk before compression) and of the index to come."""
        return self._written + self._size + self._waiting + self._index_size

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
        self._index_size += len(self._chunks[-1])
        self._times = [min([first, *self._times[:1]]), max([last, *self._times[1:]])]
        self._parts, self._size, self._waiting = [self._known], len(self._known), 0
        self._entries.clear()

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
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
