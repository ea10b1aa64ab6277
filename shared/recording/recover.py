"""What is left of a damaged recording: intact chunks and the metadata."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap import records
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.recording.metadata import CHANNELS, PROFILE, unseal
from quadriga.shared.recording.reader import (
    CORRUPT,
    RECORD,
    ChunkEntry,
    content_of,
    messages_of,
    name_of,
    stream,
)

_HEAD: Final = re.compile(rb"(?s)[\x01-\x0f\x80-\xff].{4}\0{4}")  # of a record below 4 GiB
# What a packed chunk begins with, or metadata.
_KEPT: Final = re.compile(rb"(?s)\x06.{4}\0{4}.{28}(?:\x03\0{3}lz4|\x04\0{3}zstd)|\x0c.{4}\0{4}")
_HEADER: Final = 64  # bytes within which a file's header names the program that wrote it
_CUT: Final = "the file ends in the middle"


@dataclass(frozen=True, slots=True)
class Damage:
    """A part of a file that cannot be read.

    Attributes:
        at: its first byte.
        size: bytes.
        what: what is wrong with it.
    """

    at: int
    size: int
    what: str

    def __str__(self) -> str:
        where = f"byte {self.at:,}"
        if self.size > 1:
            where = f"bytes {self.at:,} to {self.at + self.size - 1:,}"
        return f"{where}: {self.what}"


class DamagedRecording:
    """A damaged recording, read as far as it can be.

    Where no record begins, the next intact chunk, or metadata, is looked for.

    Attributes:
        metadata: what the writer was given, {} if no copy of it is intact.
        notes: what the writer noted at the end, by name, see `Recording.notes`.
        damages: what was found unreadable so far, in the order of the file.
    """

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            RecordingError: no such file, an empty one, or one in which nothing of a recording of
                this project is left.
        """
        self.path = path
        self.damages: list[Damage] = []
        self.metadata: dict[str, str] = {}
        self.notes: dict[str, dict[str, str]] = {}
        self._noted: dict[int, str | None] = {}  # keys by channel
        with name_file_errors(RecordingError, path, "a recording"), path.open("rb") as file:
            try:
                self._file = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            except ValueError:
                raise RecordingError(str(path), "an empty file", "a recording") from None
        self._chunks = list(self._scan())
        self._scanned = tuple(self.damages)
        ours = self.metadata or PROFILE.encode() in self._file[:_HEADER]
        if not ours and not any(name_of(entry.key) for entry in self.entries()):
            raise RecordingError(
                str(path),
                f"{len(self._file):,} bytes that hold nothing of a recording",
                "a recording made by `quadriga`",
                "a file of another program, or nothing is left",
            )

    def entries(self) -> Iterator[ChunkEntry]:
        """Every message that can be read, in the order of the file."""
        self.damages = list(self._scanned)
        keys = dict(self._noted)
        for at, end in self._chunks:
            try:
                yield from messages_of(content_of(self._file[at + RECORD.size : end]), keys)
            except CORRUPT as error:  # of another program: its checksum is right
                self.damages.append(Damage(at, end - at, f"a foreign chunk ({error})"))
        self.damages.sort(key=lambda damage: damage.at)

    def _scan(self) -> Iterator[tuple[int, int]]:
        """Begin and end of all chunks. Notes damages, and metadata as they pass by."""
        file, size = self._file, len(self._file)
        at = min(len(MCAP0_MAGIC), size)
        if file[:at] != MCAP0_MAGIC:
            self.damages.append(Damage(0, at, "not the beginning of an MCAP file"))
        done = size - len(MCAP0_MAGIC) if file[-len(MCAP0_MAGIC) :] == MCAP0_MAGIC else size
        while at < done:
            end = self._end_of(at)
            if end and file[at] == Opcode.CHUNK:
                yield at, end
            at = end or self._pass_damage(at, done)
        if done == size and not (self.damages and self.damages[-1].what == _CUT):
            self.damages.append(Damage(done, 0, _CUT))

    def _end_of(self, at: int) -> int:
        """End of the intact record at a byte, 0 if there is none."""
        file = self._file
        if not _HEAD.match(file, at):
            return 0
        end = at + RECORD.size + int(RECORD.unpack_from(file, at)[1])
        content = file[at + RECORD.size : end]
        with suppress(*CORRUPT):
            if file[at] == Opcode.CHUNK:
                return end if content_of(content) else 0
            if end > len(file) or not self._is_head(end):
                return 0
            if file[at] == Opcode.METADATA:
                return end if self._keep(records.Metadata.read(stream(content))) else 0
            return end
        return 0

    def _pass_damage(self, at: int, done: int) -> int:
        """Where the next record begins after a byte at which none that is intact does."""
        starts = (found.start() for found in _KEPT.finditer(self._file, at + 1))
        end = next((start for start in starts if self._end_of(start)), done)
        what = "no record begins here"
        if end == done == len(self._file):
            what = _CUT
        elif self._file[at] == Opcode.CHUNK:
            what = "a chunk that fails its checksum"
        self.damages.append(Damage(at, end - at, what))
        return end

    def _is_head(self, at: int) -> bool:
        """Whether a record, or the end of the file, may be at a byte."""
        rest = self._file[at : at + RECORD.size]
        return rest in (b"", MCAP0_MAGIC) or _HEAD.fullmatch(rest) is not None

    def _keep(self, record: records.Metadata) -> bool:
        """Keep metadata; False if they are damaged."""
        if record.name not in (PROFILE, CHANNELS):
            self.notes.setdefault(record.name, dict(record.metadata))
            return True
        with suppress(RecordingError, ValueError):
            values = unseal(record.metadata, str(self.path))
            if record.name == PROFILE:
                self.metadata = self.metadata or values
            else:
                self._noted |= {int(channel): key for channel, key in values.items()}
            return True
        return False
