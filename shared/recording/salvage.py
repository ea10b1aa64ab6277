"""What is left of a damaged recording: every chunk that passes its checksum, wherever it lies."""

from __future__ import annotations

import heapq
import mmap
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Metadata
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.errors import NewerRecordingError, RecordingError, system_reason
from quadriga.shared.recording.mcap_chunk import RECORD, ChunkEntry, messages_of, name_of, stream
from quadriga.shared.recording.seal import unseal
from quadriga.shared.recording.unpacking import CORRUPT, UNPACK
from quadriga.shared.recording.writer import COUNTS, END, LOST, PROFILE, SINCE

# How a chunk record begins: opcode, length, first and last log time, size, checksum. Then come the
# name of its packing, with its length, the packed size, and what is packed.
_CHUNK: Final = struct.Struct("<BQQQQI")
_PACKED_SIZE: Final = struct.Struct("<Q")
_FOOTER_SIZE: Final = RECORD.size + 20
_CUT: Final = "the file ends in the middle"
_HEADER: Final = 64  # bytes within which a file's header names the program that wrote it
_QUIET: Final = frozenset(
    (Opcode.HEADER, Opcode.MESSAGE_INDEX, Opcode.DATA_END, Opcode.SCHEMA, Opcode.CHANNEL,
     Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.METADATA, Opcode.METADATA_INDEX,
     Opcode.SUMMARY_OFFSET, Opcode.FOOTER)
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Damage:
    """A part of a file that cannot be read.

    Attributes:
        at: its first byte.
        size: bytes.
        what: what is wrong with it.
        log_times: of a chunk, first and last log time of its messages as it says, ns.
    """

    at: int
    size: int
    what: str
    log_times: tuple[int, int] | None = None

    def __str__(self) -> str:
        where = f"byte {self.at:,}"
        if self.size > 1:
            where = f"bytes {self.at:,} to {self.at + self.size - 1:,}"
        return f"{where}: {self.what}"


class Salvage:
    """A damaged recording, read as far as it can be.

    Attributes:
        metadata: what the writer was given, {} if no copy of it is intact.
        notes: what the writer noted at the end, by name, see `Recording.notes`.
        chunks: intact chunks read so far.
        damages: what was found unreadable so far, in the order of the file.
    """

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            RecordingError: no such file, an empty one, one in which nothing of a recording of
                this project is left, or one of a newer format.
        """
        self.path = path
        self.chunks = 0
        self.damages: list[Damage] = []
        self.metadata: dict[str, str] = {}
        self.notes: dict[str, dict[str, str]] = {}
        try:
            with path.open("rb") as file:
                self._file = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except ValueError:
            raise RecordingError(str(path), "an empty file", "a recording") from None
        except OSError as error:
            raise RecordingError(str(path), system_reason(error), "a recording") from None
        mine = self._read_metadata()
        if not (mine or any(name_of(entry.key) for entry in self.entries())):
            raise RecordingError(
                str(path),
                f"{len(self._file):,} bytes that hold nothing of a recording",
                "a damaged recording made by `quadriga`",
                "a foreign file, or nothing is left",
            )

    def entries(self) -> Iterator[ChunkEntry]:
        """Every message that can be read, in the order of the file.

        Raises:
            RecordingError: the messages are of a schema later than this version's.
        """
        self.chunks, self.damages = 0, []
        keys: dict[int, str | None] = dict(self._indexed_keys())
        anchor = 0
        for at, end, content in self._intact():
            self._explain(anchor, at)
            self.chunks += 1
            try:
                yield from messages_of(content, keys, str(self.path))
            except CORRUPT as error:  # of another program: its checksum is right
                self.damages.append(Damage(at, end - at, f"a foreign chunk ({error})"))
            anchor = end
        self._explain(anchor, len(self._file))

    def _intact(self) -> Iterator[tuple[int, int, bytes]]:
        """Begin, end and content of every chunk that passes its checksum."""
        behind = 0  # the last one
        for position, packing in heapq.merge(*map(self._find_tags, UNPACK)):
            at = position - _CHUNK.size
            found = self._content(at, packing) if at >= behind else None
            if found is not None:
                behind, content = found
                yield at, behind, content

    def _find_tags(self, packing: str) -> Iterator[tuple[int, str]]:
        """Where the name of a packing stands as it does in a chunk."""
        tag, at = _tag(packing), -1
        while (at := self._file.find(tag, at + 1)) >= 0:
            yield at, packing

    def _content(self, at: int, packing: str) -> tuple[int, bytes] | None:
        """End and content of the chunk at a byte, None if it is none or damaged."""
        file = self._file
        begin = at + _CHUNK.size + len(_tag(packing)) + _PACKED_SIZE.size
        if begin > len(file):
            return None
        *_, size, crc = _CHUNK.unpack_from(file, at)
        end = begin + _PACKED_SIZE.unpack_from(file, begin - _PACKED_SIZE.size)[0]
        if end > len(file):
            return None
        try:
            content = UNPACK[packing](file[begin:end], size)
        except CORRUPT:
            return None
        return (end, content) if zlib.crc32(content) == crc else None

    def _explain(self, at: int, end: int) -> None:
        """Name what of the bytes between two intact chunks is damaged."""
        file = self._file
        if at == 0:
            if file[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
                self._note(0, min(len(MCAP0_MAGIC), end), "not the beginning of an MCAP file")
            at = min(len(MCAP0_MAGIC), end)
        while at < end:
            if file[at:end] == MCAP0_MAGIC and end == len(file):
                return
            if end - at < RECORD.size:
                break
            opcode, length = RECORD.unpack_from(file, at)
            after = at + RECORD.size + length
            if after > end or (opcode not in _QUIET and opcode != Opcode.CHUNK):
                break
            if opcode == Opcode.CHUNK:
                self._note_chunk(at, after)
            elif opcode == Opcode.METADATA and self._metadata_at(at, after) is None:
                self._note(at, after - at, "metadata that cannot be read")
            at = after
        if at < end:
            cut = end == len(file)
            self._note(at, end - at, _CUT if cut else "no record begins here")
        elif end == len(file):
            self._note(end, 0, _CUT)

    def _note_chunk(self, at: int, after: int) -> None:
        times = None
        if after - at >= _CHUNK.size:
            _, _, first, last, *_ = _CHUNK.unpack_from(self._file, at)
            times = first, last
        self.damages.append(Damage(at, after - at, "a chunk that fails its checksum", times))

    def _note(self, at: int, size: int, what: str) -> None:
        self.damages.append(Damage(at, size, what))

    def _metadata_at(self, at: int, after: int) -> Metadata | None:
        """The metadata record there, None if it is damaged."""
        try:
            record = Metadata.read(stream(self._file[at + RECORD.size : after]))
        except CORRUPT:
            return None
        if record.name == PROFILE:
            try:
                record.metadata = unseal(record.metadata, str(self.path))
            except NewerRecordingError:
                raise
            except RecordingError:
                return None
        return record

    def _read_metadata(self) -> bool:
        """Find the metadata; whether any trace of them was found."""
        file, any_trace = self._file, False
        for tag in (_tag(PROFILE), *map(_tag, (COUNTS, LOST, SINCE, END))):
            at = -1
            while (at := file.find(tag, at + 1)) >= RECORD.size:
                opcode, length = RECORD.unpack_from(file, at - RECORD.size)
                if opcode != Opcode.METADATA:
                    any_trace = any_trace or at < _HEADER
                    continue
                any_trace = True
                record = self._metadata_at(at - RECORD.size, at + length)
                if record is not None and record.name == PROFILE:
                    self.metadata = self.metadata or dict(record.metadata)
                elif record is not None:
                    self.notes.setdefault(record.name, dict(record.metadata))
        return any_trace

    def _indexed_keys(self) -> dict[int, str]:
        """Keys by channel from the index at the file's end, if that is intact."""
        file, end = self._file, len(self._file) - len(MCAP0_MAGIC)
        try:
            footer = Footer.read(stream(file[end - 20 : end]))
            start = footer.summary_start
            if not 0 < start < end or zlib.crc32(file[start : end - 4]) != footer.summary_crc:
                return {}
            keys, at = {}, start
            while at < end - _FOOTER_SIZE:
                opcode, length = RECORD.unpack_from(file, at)
                at += RECORD.size
                if opcode == Opcode.CHANNEL:
                    channel = Channel.read(stream(file[at : at + length]))
                    keys[channel.id] = channel.topic
                at += length
        except CORRUPT:
            return {}
        return keys


def _tag(name: str) -> bytes:
    """How the content of a metadata record of that name begins."""
    return struct.pack("<I", len(name)) + name.encode()
