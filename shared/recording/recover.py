"""What is left of a cut or damaged recording: every intact chunk and the notes around them."""

from __future__ import annotations

import mmap
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap.opcode import Opcode
from mcap.records import Metadata
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.errors import NewerRecordingError, RecordingError, system_reason
from quadriga.shared.recording.metadata import PROFILE, unseal
from quadriga.shared.recording.reader import (
    CORRUPT,
    RECORD,
    ChunkEntry,
    content_of,
    messages_of,
    name_of,
    stream,
)

# A chunk's record: opcode, length, first and last log time, size, checksum, packing.
_CHUNK: Final = struct.Struct("<BQQQQI")
_ANY_CHUNK: Final = re.compile(rb"(?s)\x06.{4}\0{4}.{28}(?:\x03\0{3}lz4|\x04\0{3}zstd)")
_HEADER: Final = 64  # bytes within which a file's header names the program that wrote it


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


class DamagedRecording:
    """A cut or damaged recording, read as far as it can be.

    Where no record begins, reading goes on at the next chunk whose checksum is right.

    Attributes:
        metadata: what the writer was given, {} if no copy of it is intact.
        notes: what the writer noted at the end, by name, see `Recording.notes`.
        damages: what was found unreadable, in the order of the file.
    """

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            RecordingError: no such file, an empty one, one in which nothing of a recording of
                this project is left, or one of a newer format.
        """
        self.path = path
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
        self._chunks = list(self._scan())
        if self.metadata or PROFILE.encode() in self._file[:_HEADER]:
            return
        if not any(name_of(entry.key) for entry in self.entries()):
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
        keys: dict[int, str | None] = {}
        foreign = list[Damage]()
        for at, end in self._chunks:
            try:
                yield from messages_of(self._content(at, end), keys, str(self.path))
            except CORRUPT as error:  # of another program: its checksum is right
                foreign.append(Damage(at, end - at, f"a foreign chunk ({error})"))
        known = {damage.at for damage in self.damages}
        self.damages += [damage for damage in foreign if damage.at not in known]
        self.damages.sort(key=lambda damage: damage.at)

    def _scan(self) -> Iterator[tuple[int, int]]:
        """Begin and end of every intact chunk; notes damages, and metadata as they pass by."""
        file, at = self._file, len(MCAP0_MAGIC)
        done = len(file) - len(MCAP0_MAGIC) if file[-at:] == MCAP0_MAGIC else len(file)
        if file[:at] != MCAP0_MAGIC:
            self._note(0, min(at, len(file)), "not the beginning of an MCAP file")
        while at < done:
            end = self._end_of(at)
            opcode = file[at]
            if not end or opcode not in (Opcode.CHUNK, Opcode.METADATA):
                after = end
            elif opcode == Opcode.CHUNK and self._is_intact(at, end):
                yield at, end
                after = end
            elif opcode == Opcode.METADATA and self._keep_metadata(at, end):
                after = end
            elif end < len(file) and self._end_of(end):  # its length is right
                self._note_bad(at, end)
                after = end
            else:
                after = 0
            if not after:
                after = self._next_chunk(at + 1) or done
                what = "no record begins here" if after < done else "the file ends in the middle"
                self._note(at, after - at, what)
            at = after
        if done == len(file):
            self._note(done, 0, "the file ends in the middle")

    def _end_of(self, at: int) -> int:
        """End of the record that may be at a byte, with another or the file's end behind it; 0."""
        file = self._file
        if len(file) - at < RECORD.size or not Opcode.HEADER <= file[at] <= Opcode.DATA_END:
            return 0
        end: int = at + RECORD.size + RECORD.unpack_from(file, at)[1]
        if end > len(file):
            return 0
        head = file[end : end + RECORD.size]
        if head == MCAP0_MAGIC or len(head) < RECORD.size:
            return end
        return end if Opcode.HEADER <= head[0] <= Opcode.DATA_END and head[5:] == bytes(4) else 0

    def _next_chunk(self, at: int) -> int:
        """First byte from `at` on at which an intact chunk begins; 0 if there is none."""
        for found in _ANY_CHUNK.finditer(self._file, at):
            end = self._end_of(found.start())
            if end and self._is_intact(found.start(), end):
                return found.start()
        return 0

    def _is_intact(self, at: int, end: int) -> bool:
        try:
            self._content(at, end)
        except CORRUPT:
            return False
        return True

    def _content(self, at: int, end: int) -> bytes:
        """The records in the chunk between two bytes, see `content_of`."""
        return content_of(self._file[at + RECORD.size : end])

    def _note(self, at: int, size: int, what: str) -> None:
        self.damages.append(Damage(at, size, what))

    def _note_bad(self, at: int, end: int) -> None:
        """Note that a chunk, or metadata, cannot be read."""
        if self._file[at] == Opcode.METADATA:
            self._note(at, end - at, "metadata that cannot be read")
            return
        times = _CHUNK.unpack_from(self._file, at)[2:4] if end - at >= _CHUNK.size else None
        self.damages.append(Damage(at, end - at, "a chunk that fails its checksum", times))

    def _keep_metadata(self, at: int, end: int) -> bool:
        """Keep metadata; False if they are damaged."""
        try:
            record = Metadata.read(stream(self._file[at + RECORD.size : end]))
            if record.name == PROFILE:
                self.metadata = self.metadata or unseal(record.metadata, str(self.path))
            else:
                self.notes.setdefault(record.name, dict(record.metadata))
        except NewerRecordingError:
            raise
        except (*CORRUPT, RecordingError):
            return False
        return True
