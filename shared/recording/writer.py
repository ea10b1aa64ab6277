"""Writing MCAP recordings of all traffic.

The MCAP library writes; chunks, data section and summary carry checksums, so that no flipped bit
goes unnoticed. The keys of channels also stand in metadata of their own, so that the other chunks
can be read when the one that declares a channel is damaged.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from mcap.writer import CompressionType

from quadriga.shared.codec import envelope
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.link.ticks import LinkMessage
from quadriga.shared.recording.block_writer import BlockWriter, RecordedMessage
from quadriga.shared.recording.metadata import CHANNELS, COUNTS, LOST, PROFILE, seal
from quadriga.shared.recording.quota import OVERSIZED, REFUSED, Quota
from quadriga.shared.recording.ticks import TickTrack, lost_by_key
from quadriga.shared.schema import json_schema
from quadriga.shared.topics import TABLE, find_topic

# Bytes that a message takes at most in a file beside its payload, in chunk and index.
MESSAGE_SIZE: Final = 64
CHUNK_KIB: Final = 256  # largest chunk; the recorder closes one after 50 ms anyway
_CHUNK_SIZE: Final = 256  # bytes of a chunk's index without its channels, and with each of them
_PER_CHANNEL: Final = 16


class RecordingWriter:
    """Writes messages as sent: topic = key, log time = reception, publish time = world time.

    A message whose envelope cannot be read is written all the same, with its log time as
    publish time.

    Attributes:
        quota: what is not written, and how much of that there was.
        messages: how many were written.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        chunk_kib: int = CHUNK_KIB,
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
        self.messages = 0
        if path.exists():
            cause = "recordings are never overwritten"
            raise RecordingError(str(path), "a file that exists", "a new one", cause)
        with name_file_errors(RecordingError, path, "a writable folder"):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        self._mcap = BlockWriter(
            self._file, chunk_kib * 1024, CompressionType.LZ4, enable_data_crcs=True
        )
        self._mcap.start(PROFILE, "quadriga")
        self._metadata = seal(metadata)
        self._mcap.add_metadata(PROFILE, self._metadata)
        self._open = 0  # bytes in the open chunk
        outside = {"description": "a key outside the table of topics"}
        self._schemas = {"": self._schema("unknown", outside)}
        for topic in TABLE:
            self._schemas[topic.name] = self._schema(topic.type.__name__, json_schema(topic.type))
        # Bytes of what `finish` writes: the metadata, and the schemas again.
        self._end_size = 1024 + len(json.dumps(self._metadata).encode()) + self._open
        self._channels: dict[str, tuple[int, TickTrack]] = {}
        self._new: dict[str, str] = {}  # keys by channel, not in the metadata so far
        self._periods, self._after = periods or {}, after or {}
        self._file.flush()
        self._closed_at = self._file.tell()  # where the last chunk ends

    @property
    def size(self) -> int:
        """Bytes that the file will not exceed if it is finished now; to be asked often."""
        at = self._file.tell()
        if at != self._closed_at:
            self._closed_at, self._open = at, 0
            self._end_size += _CHUNK_SIZE + _PER_CHANNEL * len(self._channels)
        return at + self._open + self._end_size

    @property
    def tracks(self) -> dict[str, TickTrack]:
        """Ticks by key."""
        return {key: track for key, (_, track) in self._channels.items()}

    def write(self, key: str, payload: bytes, log_time_ns: int) -> None:
        """Append one message as sent; `log_time_ns` is its reception, see `clock.log_ns`."""
        if len(payload) > self.quota.largest:
            self.quota.refused[OVERSIZED] += 1
            return
        if (row := self._admitted(key)) is not None:
            channel, track = row
            tick, publish_time = envelope(payload) or (-1, log_time_ns)
            self._mcap.add_message(channel, log_time_ns, payload, publish_time, track.count)
            track.note(tick)
            self._open += MESSAGE_SIZE + len(payload)
            self.messages += 1

    def write_all(self, messages: Iterable[LinkMessage]) -> None:
        """Append messages of a plant link."""
        added, size = list[RecordedMessage](), 0
        for log_ns, _, _, key, tick, payload in messages:
            if (row := self._channels.get(key) or self._admitted(key)) is not None:
                channel, track = row
                added.append((channel, log_ns, 1_000_000 * tick, track.count, payload))
                size += MESSAGE_SIZE + len(payload)
                track.note(tick)
        if added:
            self._mcap.add_messages(added)
        self._open += size
        self.messages += len(added)

    def _admitted(self, key: str) -> tuple[int, TickTrack] | None:
        """Channel and ticks of a key; None, and a message more refused, if there is no room."""
        row = self._channels.get(key)
        if row is None and self.quota.admits(key, len(self._channels)):
            row = self._channels[key] = self._channel(key)
        self.quota.refused[REFUSED] += row is None
        return row

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Write down something about the recording, see `Recording.notes`."""
        self._mcap.add_metadata(name, dict(values))

    def flush(self) -> None:
        """Close the open chunk, so that what was written so far survives a kill.

        Raises:
            RecordingError: the file was deleted.
        """
        self._close_chunk()
        if not os.fstat(self._file.fileno()).st_nlink:
            expected = "one that stays while the team walks"
            raise RecordingError(self._file.name, "a file that was deleted", expected)

    def finish(self) -> None:
        """Write counters and index and close the file; a second call does nothing.

        The metadata are repeated, should those at the file's beginning be damaged one day.
        """
        if self._file.closed:
            return
        counts = {"messages": self.messages, **self.quota.refused}
        with self._file:  # closed also if the disk is full
            self._close_chunk()
            for name, values in ((COUNTS, counts), (LOST, lost_by_key(self.tracks))):
                self.note(name, {key: str(value) for key, value in values.items()})
            self.note(PROFILE, self._metadata)
            self._mcap.finish()

    def _close_chunk(self) -> None:
        if self._new:
            self._mcap.add_metadata(CHANNELS, seal(self._new))
            self._new = {}
        self._mcap.flush()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.finish()

    def _schema(self, name: str, schema: Mapping[str, Any]) -> int:
        text = json.dumps(schema, ensure_ascii=False).encode()
        self._open += MESSAGE_SIZE + len(text)
        schema_id: int = self._mcap.register_schema(f"{PROFILE}.{name}", "jsonschema", text)
        return schema_id

    def _channel(self, key: str) -> tuple[int, TickTrack]:
        topic, _ = find_topic(key)
        name, encoding = (topic.name, "msgpack") if topic else ("", "application/octet-stream")
        channel = self._mcap.register_channel(key, encoding, self._schemas[name])
        self._new[str(channel)] = key
        self._end_size += 4 * len(key) + 256  # in the index and in what is noted at the end
        track = TickTrack(self._periods.get(name, 0), self._after.get(key, -1))
        return channel, track
