"""Writing MCAP recordings of all traffic."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from quadriga.shared.errors import RecordingError, system_reason
from quadriga.shared.recording.admission import Admission
from quadriga.shared.recording.mcap_file import McapFile
from quadriga.shared.recording.seal import seal
from quadriga.shared.recording.sequence import TickTrack, lost_by_key
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.schema import json_schema
from quadriga.shared.wire.topics import TABLE, Topic, find_topic

RECORDING: Final = "run.mcap"  # in a run folder
PROFILE: Final = "quadriga"
COUNTS: Final = f"{PROFILE}.counts"  # written at the end: what the writer counted
LOST: Final = f"{PROFILE}.lost"  # by key, messages that did not come
SINCE: Final = f"{PROFILE}.since"  # by key, tick of its first message
END: Final = f"{PROFILE}.end"  # code, detail and tick of an end that nobody announced
_UNKNOWN: Final = f"{PROFILE}.unknown"


class RecordingWriter:
    """Writes messages as sent: topic = key, log time = reception, publish time = world time.

    A message whose envelope cannot be read is written all the same, with its log time as
    publish time, and counted.

    Attributes:
        admission: what is not written, and how much of that there was.
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
        admission: Admission | None = None,
    ) -> None:
        """Create the file.

        Args:
            path: a file that does not exist yet; its folder is created.
            metadata: what the reader hands back: configuration, hashes, versions, team.
            chunk_kib: size of the chunks, KiB.
            periods: by a topic's name, ms between its messages, see
                `quadriga.shared.config.timing`; without them nothing is counted as lost.
            after: by key, tick of the last message in the file before this one.
            admission: what is written; by default all of the table of topics, and some of the rest.

        Raises:
            RecordingError: the file exists or cannot be created.
        """
        self.admission = admission or Admission()
        self.messages = self.unreadable = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        except OSError as error:
            if path.exists():
                raise RecordingError(
                    str(path), "a file that exists", "a new one", "recordings are never overwritten"
                ) from None
            raise RecordingError(str(path), system_reason(error), "a writable folder") from None
        self._mcap = McapFile(self._file, chunk_kib * 1024, PROFILE, "quadriga")
        self._metadata = seal(metadata)
        self._mcap.metadata(PROFILE, self._metadata)
        self._schemas = {topic.name: self._schema(topic) for topic in TABLE}
        self._unknown = self._mcap.schema(
            _UNKNOWN, '{"description":"a key outside the table of topics"}'
        )
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
            if not self.admission.admits_key(key, len(self._channels)):
                return
            row = self._channels[key] = self._channel(key)
        channel, track, own = row
        if not self.admission.admits_payload(len(payload), own=own):
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
            raise RecordingError(
                self._file.name, "a file that was deleted", "one that stays while the team walks"
            )

    def finish(self) -> None:
        """Write counters and index and close the file; a second call does nothing.

        The metadata are repeated, should those at the file's beginning be damaged one day.
        """
        if self._file.closed:
            return
        tracks = self.tracks
        since = {key: track.first for key, track in sorted(tracks.items())}
        counts = {"messages": self.messages, "unreadable": self.unreadable}
        counts |= self.admission.refused
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

    def _schema(self, topic: Topic) -> int:
        text = json.dumps(json_schema(topic.type), ensure_ascii=False)
        return self._mcap.schema(f"{PROFILE}.{topic.type.__name__}", text)

    def _channel(self, key: str) -> tuple[int, TickTrack, bool]:
        topic, _ = find_topic(key)
        if topic is None:
            name, schema, encoding = "", self._unknown, "application/octet-stream"
        else:
            name, schema, encoding = topic.name, self._schemas[topic.name], "msgpack"
        self._end_size += 2 * len(key) + 64  # of what is noted of it at the end
        track = TickTrack(self._periods.get(name, 0), self._after.get(key, -1))
        return self._mcap.channel(key, encoding, schema), track, self.admission.is_own(key)
