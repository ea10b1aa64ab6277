"""Reading MCAP recordings of all traffic, whole ones and such that are cut.

`quadriga.shared.recording.recover` reads what is left of a damaged one. Files are read as the
recorder writes them: messages in packed chunks, with checksums and an index.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Container, Iterator
from contextlib import suppress
from io import SEEK_CUR, SEEK_END, BytesIO
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Metadata
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.codec import decode, envelope
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.messages import Message
from quadriga.shared.recording.metadata import PROFILE, unseal
from quadriga.shared.topics import TABLE, find_topic, topic_of

M = TypeVar("M", bound=Message)

RECORD: Final = struct.Struct("<BQ")  # opcode, length
LARGEST_CHUNK: Final = 1 << 27  # bytes unpacked
# What the MCAP library, LZ4 and Zstandard raise on bytes that are no record.
CORRUPT: Final = (
    *(McapError, struct.error, ValueError, RuntimeError, IndexError, EOFError, MemoryError),
    *(OverflowError, zstandard.ZstdError),
)

_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_LATEST: Final = (1 << 63) - 1  # ns: what MCAP has 64 bits for, tables have 63 and a sign
_RECOVER: Final = "`quadriga recover` writes what is readable"
_MEND: Final = f"one cut or damaged in its first bytes: {_RECOVER}"
_DATA_END: Final = struct.Struct("<BQI")  # the record before the index: opcode, length, checksum
_FOOTER: Final = 20  # bytes of its content


class ChunkEntry(NamedTuple):
    """One recorded message; `tick` is -1 where it carries none that can be read."""

    key: str
    tick: int
    log_time_ns: int
    payload: bytes


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
        self.damages: tuple[()] = ()  # none can be told apart: `DamagedRecording` does
        with (
            name_file_errors(RecordingError, path, "a recording", "did the walk start?"),
            path.open("rb") as file,
        ):
            head = file.read(len(MCAP0_MAGIC))
            self._size = file.seek(0, SEEK_END)
            file.seek(max(self._size - len(MCAP0_MAGIC), 0))
            self.complete = file.tell() > 0 and file.read() == MCAP0_MAGIC
        if head != MCAP0_MAGIC:
            if not self._size:
                raise RecordingError(str(path), "an empty file", "a recording")
            got = f"{self._size:,} bytes that do not start as MCAP"
            raise RecordingError(str(path), got, "an MCAP file", f"a foreign file, or {_MEND}")
        for record in self._metadata():
            if record.name == PROFILE:
                self.metadata = unseal(record.metadata, str(path))
                return
        got, expected = "no metadata of this project", "a recording made by `quadriga`"
        raise RecordingError(str(path), got, expected, f"a foreign MCAP file, or {_MEND}")

    def entries(
        self, names: Container[str] | None = None, keys: Container[str] | None = None
    ) -> Iterator[ChunkEntry]:
        """Recorded messages in the order of the file; what is not asked for is skipped cheaply.

        Args:
            names: only topics of these names (`Topic.name`); None gives every message, also of
                keys outside the table.
            keys: only these keys; None gives all.
        """
        wanted: dict[int, str | None] = {}
        for opcode, content in self._records(skip=Opcode.METADATA):
            try:
                if opcode == Opcode.CHUNK:
                    yield from messages_of(content_of(content), wanted, names, keys)
                elif opcode == Opcode.MESSAGE:
                    raise ValueError("messages outside of chunks")
            except CORRUPT as error:
                self.cut = f"a record of {len(content)} bytes is corrupt ({error})"
                return

    def messages(self, kind: type[M], robot: str = "") -> Iterator[M]:
        """Decoded messages of a type (of one robot, or of all).

        Raises:
            MessageError: a recorded message is not valid.
        """
        name = next(topic.name for topic in TABLE if topic.type is kind)
        for entry in self.entries({name}):
            if not robot or topic_of(entry.key)[1] == robot:
                yield decode(entry.payload, kind)

    def require_whole(self) -> None:
        """Make sure that the file was finished and not a bit of it has changed since.

        Raises:
            RecordingError: it is cut or damaged.
        """
        if not self.complete:
            raise self._damage_error(f"a file that is cut after {self._size:,} bytes")
        content, end = np.memmap(self.path, np.uint8, "r").data, self._size - len(MCAP0_MAGIC)
        with suppress(*CORRUPT):
            start = Footer.read(stream(content[end - _FOOTER : end].tobytes())).summary_start
            data = start - _DATA_END.size
            data_end = _DATA_END.pack(Opcode.DATA_END, 4, zlib.crc32(content[:data]))
            summary_end = zlib.crc32(content[start : end - 4]).to_bytes(4, "little")
            if content[data:start].tobytes() + content[end - 4 : end].tobytes() == (
                data_end + summary_end
            ):
                return
        raise self._damage_error("content that fails its checksum")

    @property
    def notes(self) -> dict[str, dict[str, str]]:
        """What the writer noted at the end, by name: `COUNTS`, `LOST` …; {} after a kill."""
        cut = self.cut  # of the chunks, which are not read here
        notes = {record.name: dict(record.metadata) for record in self._metadata()}
        self.cut = cut
        notes.pop(PROFILE, None)
        return notes

    def _damage_error(self, got: str) -> RecordingError:
        cause = f"was the recorder killed, or the disk full? {_RECOVER}"
        return RecordingError(str(self.path), got, "a whole recording", cause)

    def _records(self, skip: Opcode) -> Iterator[tuple[int, bytes]]:
        """Opcode and content of the records, up to the cut if there is one; one kind is skipped."""
        self.cut = ""
        with self.path.open("rb") as file:
            file.seek(len(MCAP0_MAGIC))
            while len(head := file.read(RECORD.size)) == RECORD.size:
                opcode, length = RECORD.unpack(head)
                if opcode == Opcode.FOOTER:
                    return
                if file.tell() + length > self._size:
                    break
                if opcode in (skip, Opcode.MESSAGE_INDEX):
                    file.seek(length, SEEK_CUR)
                else:
                    yield opcode, file.read(length)
        self.cut = f"the file ends at byte {self._size} in the middle of a record"

    def _metadata(self) -> Iterator[Metadata]:
        for opcode, content in self._records(skip=Opcode.CHUNK):
            if opcode == Opcode.METADATA:
                with suppress(*CORRUPT):
                    yield Metadata.read(stream(content))


def messages_of(
    chunk: bytes,
    wanted: dict[int, str | None],
    names: Container[str] | None = None,
    keys: Container[str] | None = None,
) -> Iterator[ChunkEntry]:
    """Entries of one chunk.

    Args:
        chunk: its records, uncompressed.
        wanted: keys by channel, None for one that is not wanted; learns them as they pass by.
        names: of topics that are wanted; None: all, also of keys outside the table.
        keys: that are wanted; None: all.

    Raises:
        one of CORRUPT: the chunk holds what are no records.
    """
    at = 0
    while at < len(chunk):
        if chunk[at] != Opcode.MESSAGE:
            opcode, length = RECORD.unpack_from(chunk, at)
            at += RECORD.size
            channel_id = int.from_bytes(chunk[at : at + 2], "little")
            if opcode == Opcode.CHANNEL and channel_id not in wanted:  # every chunk repeats them
                key = Channel.read(stream(chunk[at : at + length])).topic
                named = names is None or name_of(key) in names
                wanted[channel_id] = key if named and (keys is None or key in keys) else None
            at += length
            continue
        _, length, channel_id, _, log_time, _ = _MESSAGE.unpack_from(chunk, at)
        wanted_key = wanted.get(channel_id)
        end = at + RECORD.size + length
        if wanted_key is not None:
            payload = chunk[at + _MESSAGE.size : end]
            head = envelope(payload)
            tick = -1 if head is None else head[0]
            yield ChunkEntry(wanted_key, tick, min(log_time, _LATEST), payload)
        at = end


def content_of(record: bytes) -> bytes:
    """The records in a chunk; no more is allocated than the chunk says that it unpacks to.

    Raises:
        one of CORRUPT: it is damaged, or packed with something else than LZ4 or Zstandard.
    """
    chunk = Chunk.read(stream(record))
    size: int = chunk.uncompressed_size
    if chunk.compression not in ("lz4", "zstd") or size > LARGEST_CHUNK:
        raise ValueError(f"{size} bytes packed with {chunk.compression[:16]!r}")
    content: bytes
    if chunk.compression == "lz4":
        unpack = lz4.frame.LZ4FrameDecompressor()
        content = unpack.decompress(chunk.data, max_length=size + 1)
    else:
        content = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
    if len(content) != size or zlib.crc32(content) != chunk.uncompressed_crc:
        raise ValueError("its checksum is wrong")
    return content


def stream(content: bytes) -> ReadDataStream:
    """The content of a record for the MCAP library."""
    return ReadDataStream(BytesIO(content))


def name_of(key: str) -> str:
    """Name of a key's topic, "" if the table has none."""
    topic, _ = find_topic(key)
    return "" if topic is None else topic.name
