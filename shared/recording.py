"""MCAP recordings of all traffic: writer, and a reader that copes with a cut file."""

from __future__ import annotations

import json
import struct
from collections.abc import Container, Iterator, Mapping
from io import SEEK_END, BytesIO
from pathlib import Path
from types import TracebackType
from typing import Final, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from shared.codec import decode
from shared.envelope import envelope
from shared.errors import MessageError, RecordingError
from shared.mcap_file import McapFile
from shared.messages import Message
from shared.schema import json_schema
from shared.topics import TABLE, Topic, topic_of

M = TypeVar("M", bound=Message)

PROFILE: Final = "quadriga"
MAX_CHANNELS: Final = 4096  # a foreign publisher must not fill the file with keys of its own
_UNKNOWN: Final = "quadriga.unknown"


class RecordingWriter:
    """Writes messages as sent: topic = key, log time = reception, publish time = world time.

    A message whose envelope cannot be read is written all the same, with its log time as
    publish time, and counted.

    Attributes:
        messages: how many were written.
        unreadable: how many of them carry no readable tick and stamp.
        refused: how many were not written because their keys exceed `MAX_CHANNELS`.
    """

    def __init__(self, path: Path, metadata: Mapping[str, str], chunk_kib: int = 256) -> None:
        """Create the file.

        Args:
            path: a file that does not exist yet; its folder is created.
            metadata: what the reader hands back: configuration, hashes, versions, team.
            chunk_kib: size of the chunks, KiB.

        Raises:
            RecordingError: the file exists or cannot be created.
        """
        self.messages = self.unreadable = self.refused = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        except OSError as error:
            if path.exists():
                raise RecordingError(
                    str(path), "a file that exists", "a new one", "recordings are never overwritten"
                ) from None
            raise RecordingError(str(path), _reason(error), "a writable folder") from None
        self._mcap = McapFile(self._file, chunk_kib * 1024, PROFILE, "quadriga")
        self._mcap.metadata(PROFILE, dict(metadata))
        self._schemas = {topic.name: self._schema(topic) for topic in TABLE}
        self._unknown = self._mcap.schema(
            _UNKNOWN, '{"description":"a key outside the table of topics"}'
        )
        self._channels: dict[str, int] = {}
        self._sequences: dict[int, int] = {}
        self._file.flush()

    def write(self, key: str, payload: bytes, log_time_ns: int) -> None:
        """Append one message as sent; `log_time_ns` is the wall clock at its reception."""
        channel = self._channels.get(key)
        if channel is None:
            if len(self._channels) >= MAX_CHANNELS:
                self.refused += 1
                return
            channel = self._channel(key)
        found = envelope(payload)
        if found is None:
            self.unreadable += 1
        sequence = self._sequences[channel]
        self._sequences[channel] = sequence + 1
        self.messages += 1
        publish_time = log_time_ns if found is None else found[1]
        self._mcap.message(channel, sequence, log_time_ns, publish_time, payload)

    def flush(self) -> None:
        """Close the open chunk, so that what was written so far survives a kill."""
        self._mcap.flush()

    def finish(self) -> None:
        """Write counters and index and close the file; a second call does nothing."""
        if self._file.closed:
            return
        self._mcap.flush()
        counts = {"messages": self.messages, "unreadable": self.unreadable, "refused": self.refused}
        self._mcap.metadata(f"{PROFILE}.counts", {k: str(v) for k, v in counts.items()})
        self._mcap.finish()
        self._file.close()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.finish()

    def _schema(self, topic: Topic) -> int:
        text = json.dumps(json_schema(topic.type), ensure_ascii=False)
        return self._mcap.schema(f"{PROFILE}.{topic.type.__name__}", text)

    def _channel(self, key: str) -> int:
        try:
            schema, encoding = self._schemas[topic_of(key)[0].name], "msgpack"
        except MessageError:
            schema, encoding = self._unknown, "application/octet-stream"
        channel = self._mcap.channel(key, encoding, schema)
        self._channels[key] = channel
        self._sequences[channel] = 0
        return channel


class Entry(NamedTuple):
    """One recorded message.

    `tick` is -1 where the message carries none that can be read.
    """

    key: str
    tick: int
    log_time_ns: int
    payload: bytes


_RECORD: Final = struct.Struct("<BQ")
_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish


class Recording:
    """A recorded run, read front to back; a cut file is read up to the cut.

    Attributes:
        metadata: what the writer was given.
        complete: whether the file was finished; False after a kill of the recorder.
        cut: where and why reading stopped early, or empty; known once the entries are read.
    """

    def __init__(self, path: Path) -> None:
        """Open a recording and read its metadata.

        Raises:
            RecordingError: no such file, an empty one, or not a recording of this project.
        """
        self.path, self.cut = path, ""
        try:
            with path.open("rb") as file:
                head = file.read(len(MCAP0_MAGIC))
                self._size = file.seek(0, SEEK_END)
                file.seek(max(self._size - len(MCAP0_MAGIC), 0))
                self.complete = file.tell() > 0 and file.read() == MCAP0_MAGIC
        except OSError as error:
            raise RecordingError(
                str(path), _reason(error), "a recording", "did the walk start?"
            ) from None
        if head != MCAP0_MAGIC:
            got = f"{self._size} bytes that do not start as MCAP" if self._size else "an empty file"
            raise RecordingError(str(path), got, "an MCAP file")
        self.metadata = self._metadata()

    def entries(self, names: Container[str] | None = None) -> Iterator[Entry]:
        """Recorded messages in the order of the file.

        Args:
            names: only topics of these names (`Topic.name`), others are skipped cheaply;
                None gives every message, also of keys outside the table.
        """
        wanted: dict[int, str] = {}
        for chunk in self._chunks():
            yield from _messages(chunk, names, wanted)

    def messages(self, kind: type[M], robot: str = "") -> Iterator[M]:
        """Decoded messages of a type (of one robot, or of all).

        Raises:
            MessageError: a recorded message is not valid.
        """
        name = next(topic.name for topic in TABLE if topic.type is kind)
        for entry in self.entries({name}):
            if not robot or topic_of(entry.key)[1] == robot:
                yield decode(entry.payload, kind)

    def _records(self) -> Iterator[tuple[int, bytes]]:
        """Opcode and content of the records outside chunks, up to the cut if there is one."""
        self.cut = ""
        with self.path.open("rb") as file:
            file.seek(len(MCAP0_MAGIC))
            while len(head := file.read(_RECORD.size)) == _RECORD.size:
                opcode, length = _RECORD.unpack(head)
                if opcode == Opcode.FOOTER:
                    return
                if file.tell() + length > self._size:
                    break
                yield opcode, file.read(length)
        self.cut = f"the file ends at byte {self._size} in the middle of a record"

    def _chunks(self) -> Iterator[bytes]:
        for opcode, content in self._records():
            if opcode == Opcode.CHUNK:
                try:
                    chunk = Chunk.read(_stream(content))
                    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
                    yield stream.read(length)
                except _CORRUPT as error:
                    self.cut = f"a chunk of {len(content)} bytes is corrupt ({error})"
                    return

    def _metadata(self) -> dict[str, str]:
        for opcode, content in self._records():
            if opcode == Opcode.METADATA:
                record = Metadata.read(_stream(content))
                if record.name == PROFILE:
                    return dict(record.metadata)
            if opcode == Opcode.CHUNK:
                break
        raise RecordingError(
            str(self.path), "no metadata of this project", "a recording made by `quadriga`",
            "a foreign MCAP file, or one cut in its first bytes",
        )  # fmt: skip


# The last is what LZ4 raises.
_CORRUPT: Final = (CRCValidationError, McapError, struct.error, UnicodeDecodeError, RuntimeError)


def _reason(error: OSError) -> str:
    return error.strerror or str(error)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))


def _messages(
    chunk: bytes, names: Container[str] | None, wanted: dict[int, str]
) -> Iterator[Entry]:
    """Entries of one chunk; `wanted` learns the keys by channel as their records pass by."""
    at = 0
    while at < len(chunk):
        if chunk[at] != Opcode.MESSAGE:
            opcode, length = _RECORD.unpack_from(chunk, at)
            at += _RECORD.size
            if opcode == Opcode.CHANNEL:
                channel = Channel.read(_stream(chunk[at : at + length]))
                if names is None or _name(channel.topic) in names:
                    wanted[channel.id] = channel.topic
            at += length
            continue
        _, length, channel_id, _, log_time, _ = _MESSAGE.unpack_from(chunk, at)
        key = wanted.get(channel_id)
        end = at + _RECORD.size + length
        if key is not None:
            payload = chunk[at + _MESSAGE.size : end]
            found = envelope(payload)
            yield Entry(key, -1 if found is None else found[0], log_time, payload)
        at = end


def _name(key: str) -> str:
    try:
        return topic_of(key)[0].name
    except MessageError:
        return ""
