"""What is left of a damaged recording: every intact chunk, and every record outside chunks."""

from __future__ import annotations

import mmap
import re
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap import records
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from quadriga.shared.errors import NewerRecordingError, RecordingError, system_reason
from quadriga.shared.recording.metadata import PROFILE, unseal
from quadriga.shared.recording.reader import (
    BARE,
    CORRUPT,
    RECORD,
    ChunkEntry,
    content_of,
    messages_of,
    name_of,
    stream,
)

_KINDS: Final = {code: getattr(records, code.name.title().replace("_", "")) for code in Opcode}
_OPAQUE: Final = (Opcode.MESSAGE, Opcode.ATTACHMENT)  # nothing in them tells where they end
_PRIVATE: Final = 0x80  # opcodes from here on are other programs' own
_HEAD: Final = re.compile(rb"(?s)[\x01-\x0f].{4}\0{4}")  # of a record below 4 GiB
# A chunk's record: opcode, length, first and last log time, size, checksum, packing, packed size.
_CHUNK: Final = struct.Struct("<BQQQQI")
_ANY_CHUNK: Final = re.compile(
    rb"\x06.{4}\0{4}.{28}(?:\0{4}|\x03\0{3}lz4|\x04\0{3}zstd)", re.DOTALL
)
_LARGEST: Final = 1 << 20  # bytes of a record, other than a chunk, that is looked for in damage
_HEADER: Final = 64  # bytes within which a file's header names the program that wrote it
_CUT: Final = "the file ends in the middle"


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
    """A damaged recording, read as far as it can be.

    Where no record begins, the next place is looked for at which one does. Messages outside
    chunks have no checksum: in a file that has chunks, none is believed after such a place.

    Attributes:
        metadata: what the writer was given, {} if no copy of it is intact.
        notes: what the writer noted at the end, by name, see `Recording.notes`.
        damages: what was found unreadable so far, in the order of the file.
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
        self._chunked = _ANY_CHUNK.search(self._file) is not None
        self._pieces = list(self._scan())
        self._scanned = tuple(self.damages)
        named = any(name.startswith(PROFILE) for name in self.notes)
        if self.metadata or named or PROFILE.encode() in self._file[:_HEADER]:
            return
        if any(name_of(entry.key) for entry in self.entries()):
            return
        if not self.damages:
            raise RecordingError(
                str(path),
                "a whole MCAP file of another program",
                "a recording made by `quadriga`",
                "it holds no message of a team",
            )
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
        self.damages = list(self._scanned)
        keys = self._indexed_keys()
        for at, end in self._pieces:
            try:
                yield from messages_of(self._content(at, end), keys, str(self.path))
            except CORRUPT as error:  # of another program: its checksum is right
                self.damages.append(Damage(at, end - at, f"a foreign chunk ({error})"))
        self.damages.sort(key=lambda damage: damage.at)

    def _scan(self) -> Iterator[tuple[int, int]]:
        """Begin and end of every chunk, and every record outside one, that holds messages.

        Notes damages, and metadata as they pass by.
        """
        file, size = self._file, len(self._file)
        magic = file[: len(MCAP0_MAGIC)] == MCAP0_MAGIC
        at = lost = min(len(MCAP0_MAGIC), size)  # `lost`: since where no record was found
        if not magic:
            self._note(0, at, "not the beginning of an MCAP file")
        done = size - len(MCAP0_MAGIC) if file[-len(MCAP0_MAGIC) :] == MCAP0_MAGIC else size
        while at < done:
            end = self._end_of(at, sure=at == lost)
            if end:
                if at > lost:
                    self._note(lost, at - lost, "no record begins here")
                if file[at] == Opcode.CHUNK or file[at] in BARE:
                    yield at, end
                at = lost = end
            elif at == lost and (end := self._end_of_bad(at)):
                at = lost = end
            else:
                found = _HEAD.search(file, at + 1)
                at = found.start() if found else done
        if lost < done or done == size:
            self._note(lost, done - lost, _CUT)

    def _end_of(self, at: int, *, sure: bool) -> int:
        """End of the intact record at a byte, 0 if there is none.

        Args:
            at: the byte.
            sure: whether the record before it ends there; else much else might look like one.
        """
        file, opcode = self._file, self._file[at]
        if len(file) - at < RECORD.size:
            return 0
        if opcode == Opcode.CHUNK:
            end = self._end_of_chunk(at)
            with suppress(*CORRUPT):
                return end if end and self._content(at, end) is not None else 0
            return 0
        length: int = RECORD.unpack_from(file, at)[1]
        end = at + RECORD.size + length
        if end > len(file) or not (sure or length <= _LARGEST):
            return 0
        if opcode in BARE and self._chunked and not sure:
            return 0
        exact = False
        if opcode in _KINDS and opcode not in _OPAQUE:
            content = stream(file[at + RECORD.size : end])
            try:
                record = _KINDS[Opcode(opcode)].read(content)
            except CORRUPT:
                return 0
            exact = content.count == length
            if opcode == Opcode.METADATA and not self._keep(record):
                return 0
        elif opcode not in _OPAQUE and opcode < _PRIVATE:
            return 0
        return end if (exact and sure) or self._is_head(end) else 0

    def _end_of_bad(self, at: int) -> int:
        """End of the damaged chunk or metadata at a byte, of which a note is taken; 0: neither."""
        file = self._file
        if len(file) - at < RECORD.size or file[at] not in (Opcode.CHUNK, Opcode.METADATA):
            return 0
        end: int = at + RECORD.size + RECORD.unpack_from(file, at)[1]
        if end >= len(file) or not self._is_head(end):
            return 0
        if file[at] == Opcode.METADATA:
            self._note(at, end - at, "metadata that cannot be read")
        else:
            times = _CHUNK.unpack_from(file, at)[2:4] if end - at >= _CHUNK.size else None
            self.damages.append(Damage(at, end - at, "a chunk that fails its checksum", times))
        return end

    def _is_head(self, at: int) -> bool:
        """Whether a record, or the end of the file, may be at a byte."""
        head = self._file[at : at + RECORD.size]
        if len(head) < RECORD.size:
            return not head or head == MCAP0_MAGIC or head[0] in _KINDS
        return _HEAD.fullmatch(head) is not None or head[0] >= _PRIVATE

    def _end_of_chunk(self, at: int) -> int:
        """End of the chunk at a byte, by the size of what is packed in it; 0 if that cannot be."""
        file, begin = self._file, at + _CHUNK.size
        packing = int.from_bytes(file[begin : begin + 4], "little")
        begin += 4 + packing
        if packing > len("zstd") or begin + 8 > len(file):
            return 0
        end = begin + 8 + int.from_bytes(file[begin : begin + 8], "little")
        return end if end <= len(file) else 0

    def _content(self, at: int, end: int) -> bytes:
        """The records in a chunk, or the one outside of any.

        Raises:
            one of CORRUPT: a damaged chunk.
        """
        if self._file[at] != Opcode.CHUNK:
            return self._file[at:end]
        return content_of(self._file[at + RECORD.size : end])

    def _note(self, at: int, size: int, what: str) -> None:
        self.damages.append(Damage(at, size, what))

    def _keep(self, record: records.Metadata) -> bool:
        """Keep metadata; False if they are damaged."""
        if record.name == PROFILE:
            try:
                values = unseal(record.metadata, str(self.path))
            except NewerRecordingError:
                raise
            except RecordingError:
                return False
            self.metadata = self.metadata or values
        else:
            self.notes.setdefault(record.name, dict(record.metadata))
        return True

    def _indexed_keys(self) -> dict[int, str | None]:
        """Keys by channel from the index at the file's end, if that is intact."""
        file, end = self._file, len(self._file) - len(MCAP0_MAGIC)
        keys: dict[int, str | None] = {}
        with suppress(*CORRUPT):
            footer = records.Footer.read(stream(file[end - 20 : end]))
            start = footer.summary_start
            if 0 < start < end and zlib.crc32(file[start : end - 4]) == footer.summary_crc:
                for _ in messages_of(file[start : end - 20 - RECORD.size], keys, str(self.path)):
                    pass
        return keys
