"""Reading MCAP recordings of all traffic: whole ones, such that are cut, and damaged ones.

Files are read as the recorder writes them: messages in packed chunks, with checksums and an index.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Container, Iterator
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
from quadriga.shared.recording.metadata import CHANNELS, PROFILE, unseal
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
_HEADER: Final = 64  # bytes within which a file's header names the program that wrote it
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
        metadata: what the writer was given; {} if no copy of it is intact.
        complete: whether the file was finished; False after a kill of the recorder.
        damages: what could not be read, in the order of the file; known once the entries are read.
    """

    def __init__(self, path: Path, *, salvage: bool = False) -> None:
        """Open a recording and read its metadata.

        Args:
            path: of the file.
            salvage: go on behind chunks that are damaged, also if no metadata are intact.

        Raises:
            RecordingError: no such file, an empty one, or not a recording of this project.
        """
        self.path, self._salvages = path, salvage
        self.damages: list[str] = []
        with (
            name_file_errors(RecordingError, path, "a recording", "did the walk start?"),
            path.open("rb") as file,
        ):
            head = file.read(_HEADER)
            self._size = file.seek(0, SEEK_END)
            file.seek(max(self._size - len(MCAP0_MAGIC), 0))
            self.complete = file.tell() > 0 and file.read() == MCAP0_MAGIC
        if not head.startswith(MCAP0_MAGIC):
            if not self._size:
                raise RecordingError(str(path), "an empty file", "a recording")
            got = f"{self._size:,} bytes that do not start as MCAP"
            raise RecordingError(str(path), got, "an MCAP file", f"a foreign file, or {_MEND}")
        got, expected = "no metadata of this project", "a recording made by `quadriga`"
        wrong = RecordingError(str(path), got, expected, f"a foreign MCAP file, or {_MEND}")
        self.metadata: dict[str, str] = {}
        self._channels: dict[int, str] = {}  # keys, as they are noted beside the chunks
        for record in self._metadata():
            try:
                if record.name == PROFILE and not self.metadata:
                    self.metadata = unseal(record.metadata, str(path))
                elif record.name == CHANNELS and salvage:
                    noted = unseal(record.metadata, str(path))
                    self._channels |= {int(channel): key for channel, key in noted.items()}
            except RecordingError as error:
                wrong = error
            except ValueError:  # of a channel that somebody has forged
                continue
            if self.metadata and not salvage:
                break
        if not self.metadata and not (salvage and PROFILE.encode() in head):
            raise wrong

    @property
    def cut(self) -> str:
        """Where and why reading stopped early, or empty; known once the entries are read."""
        return self.damages[0] if self.damages else ""

    def entries(
        self, names: Container[str] | None = None, keys: Container[str] | None = None
    ) -> Iterator[ChunkEntry]:
        """Recorded messages in the order of the file; what is not asked for is skipped cheaply.

        Args:
            names: only topics of these names (`Topic.name`); None gives every message, also of
                keys outside the table.
            keys: only these keys; None gives all.
        """

        def key_if_wanted(key: str) -> str | None:
            named = names is None or name_of(key) in names
            return key if named and (keys is None or key in keys) else None

        self.damages = []
        wanted = {channel: key_if_wanted(key) for channel, key in self._channels.items()}
        for opcode, content in self._records(self.damages, skip=Opcode.METADATA):
            try:
                if opcode == Opcode.CHUNK:
                    yield from _messages_of(content_of(content), wanted, key_if_wanted)
                elif opcode == Opcode.MESSAGE:
                    raise ValueError("messages outside of chunks")
            except CORRUPT as error:
                self.damages.append(f"a record of {len(content):,} bytes is corrupt ({error})")
                if not self._salvages:
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
        notes = {record.name: dict(record.metadata) for record in self._metadata()}
        notes.pop(PROFILE, None)
        return notes

    def _damage_error(self, got: str) -> RecordingError:
        cause = f"was the recorder killed, or the disk full? {_RECOVER}"
        return RecordingError(str(self.path), got, "a whole recording", cause)

    def _records(self, damages: list[str], skip: Opcode) -> Iterator[tuple[int, bytes]]:
        """Opcode and content of the records, up to the cut if there is one; one kind is skipped."""
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
        damages.append(f"the file ends at byte {self._size} in the middle of a record")

    def _metadata(self) -> Iterator[Metadata]:
        for opcode, content in self._records([], skip=Opcode.CHUNK):
            if opcode == Opcode.METADATA:
                with suppress(*CORRUPT):
                    yield Metadata.read(stream(content))


def _messages_of(
    chunk: bytes, wanted: dict[int, str | None], key_if_wanted: Callable[[str], str | None]
) -> Iterator[ChunkEntry]:
    """Entries of the records of a chunk.

    `wanted` has keys by channel, None for one that is not wanted; it learns them as they pass by.
    Raises one of CORRUPT of what are no records.
    """
    at = 0
    while at < len(chunk):
        if chunk[at] != Opcode.MESSAGE:
            opcode, length = RECORD.unpack_from(chunk, at)
            at += RECORD.size
            channel_id = int.from_bytes(chunk[at : at + 2], "little")
            if opcode == Opcode.CHANNEL and channel_id not in wanted:
                key = Channel.read(stream(chunk[at : at + length])).topic
                wanted[channel_id] = key_if_wanted(key)
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
        if zstandard.frame_content_size(chunk.data) not in (size, -1):  # which it would allocate
            raise ValueError(f"a frame that does not unpack to {size} bytes")
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
