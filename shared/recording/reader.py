"""Reading MCAP recordings of all traffic, whole ones and such that are cut.

`quadriga.shared.recording.salvage` reads what is left of a damaged one.
"""

from __future__ import annotations

import zlib
from collections.abc import Container, Iterator
from contextlib import suppress
from io import SEEK_CUR, SEEK_END
from pathlib import Path
from typing import BinaryIO, Final, TypeVar

from mcap.opcode import Opcode
from mcap.records import Chunk, DataEnd, Footer, Metadata
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.recording.mcap_chunk import (
    BARE,
    CORRUPT,
    RECORD,
    ChunkEntry,
    content_of,
    messages_of,
    stream,
)
from quadriga.shared.recording.seal import unseal
from quadriga.shared.recording.writer import PROFILE
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import Message
from quadriga.shared.wire.topics import TABLE, topic_of

M = TypeVar("M", bound=Message)

_RECOVER: Final = "`quadriga recover` writes what is readable"
_MEND: Final = f"one cut or damaged in its first bytes: {_RECOVER}"
_PART: Final = 1 << 20  # bytes that are read at once
_END: Final = RECORD.size + 4 + RECORD.size + 20 + len(MCAP0_MAGIC)  # DataEnd, footer, magic


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
        self.damages: tuple[()] = ()  # none can be told apart: `Salvage` does
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
        self.metadata = self._metadata()

    def entries(
        self, names: Container[str] | None = None, keys: Container[str] | None = None
    ) -> Iterator[ChunkEntry]:
        """Recorded messages in the order of the file; what is not asked for is skipped cheaply.

        Args:
            names: only topics of these names (`Topic.name`); None gives every message, also of
                keys outside the table.
            keys: only these keys; None gives all.

        Raises:
            RecordingError: the messages are of a schema later than this version's.
        """
        wanted: dict[int, str | None] = {}
        for chunk in self._chunks():
            try:
                yield from messages_of(chunk, wanted, str(self.path), names, keys)
            except CORRUPT as error:  # of another program: its checksum is right
                self.cut = f"a chunk holds what are no records ({error})"
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
        with self.path.open("rb") as file:
            file.seek(self._size - _END + RECORD.size + 4)
            end = file.read(RECORD.size + 20)
            footer = Footer.read(stream(end[RECORD.size :]))
            start = footer.summary_start or self._size - _END + RECORD.size + 4  # 0: no summary
            if end[:1] != bytes([Opcode.FOOTER]) or not _END < start < self._size:
                raise self._damage_error("an index that is not where it should be")
            file.seek(start - RECORD.size - 4)
            if file.read(RECORD.size) != RECORD.pack(Opcode.DATA_END, 4):
                raise self._damage_error("content that does not end where it should")
            crc = DataEnd.read(stream(file.read(4))).data_section_crc
            summary = file.read(self._size - len(MCAP0_MAGIC) - 4 - file.tell())
            if footer.summary_crc and zlib.crc32(summary) != footer.summary_crc:
                raise self._damage_error("an index that fails its checksum")
            if not crc:  # then those of the chunks must do
                for _ in self._chunks():
                    pass
            elif _crc(file, start - RECORD.size - 4) != crc:
                raise self._damage_error("content that fails its checksum")
        if self.cut:
            raise self._damage_error(self.cut)

    @property
    def notes(self) -> dict[str, dict[str, str]]:
        """What the writer noted at the end, by name: `COUNTS`, `LOST` …; {} after a kill."""
        notes: dict[str, dict[str, str]] = {}
        cut = self.cut  # of the chunks, which are not read here
        for _, content in self._records(only=Opcode.METADATA):
            with suppress(*CORRUPT):  # of another program: its checksum is right
                record = Metadata.read(stream(content))
                if record.name != PROFILE:
                    notes[record.name] = dict(record.metadata)
        self.cut = cut
        return notes

    def _damage_error(self, got: str) -> RecordingError:
        return RecordingError(
            str(self.path),
            got,
            "a whole recording",
            f"was the recorder killed, or the disk full? {_RECOVER}",
        )

    def _records(self, only: Opcode | None = None) -> Iterator[tuple[int, bytes]]:
        """Opcode and content of the records outside chunks, up to the cut if there is one.

        Those that are not asked for are skipped cheaply.
        """
        self.cut = ""
        with self.path.open("rb") as file:
            file.seek(len(MCAP0_MAGIC))
            while len(head := file.read(RECORD.size)) == RECORD.size:
                opcode, length = RECORD.unpack(head)
                if opcode == Opcode.FOOTER:
                    return
                if file.tell() + length > self._size:
                    break
                if only is None or opcode == only:
                    yield opcode, file.read(length)
                else:
                    file.seek(length, SEEK_CUR)
        self.cut = f"the file ends at byte {self._size} in the middle of a record"

    def _chunks(self) -> Iterator[bytes]:
        """The records in each chunk, and each of those outside of any."""
        for opcode, content in self._records():
            if opcode in BARE:
                yield RECORD.pack(opcode, len(content)) + content
            elif opcode == Opcode.CHUNK:
                try:
                    inside = content_of(Chunk.read(stream(content)))
                except CORRUPT as error:
                    self.cut = f"a chunk of {len(content)} bytes is corrupt ({error})"
                    return
                yield inside

    def _metadata(self) -> dict[str, str]:
        for opcode, content in self._records():
            if opcode == Opcode.METADATA:
                try:
                    record = Metadata.read(stream(content))
                except CORRUPT:
                    break
                if record.name == PROFILE:
                    return unseal(record.metadata, str(self.path))
            if opcode == Opcode.CHUNK:
                break
        raise RecordingError(
            str(self.path),
            "no metadata of this project",
            "a recording made by `quadriga`",
            f"a foreign MCAP file, or {_MEND}",
        )


def _crc(file: BinaryIO, length: int) -> int:
    """Checksum of the first `length` bytes of a file."""
    file.seek(0)
    crc = 0
    while length > 0 and (part := file.read(min(length, _PART))):
        crc = zlib.crc32(part, crc)
        length -= len(part)
    return crc
