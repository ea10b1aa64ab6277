"""Records that are kept until a file ends: packed, since a walk of hours has very many."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import Final

_PACKED_FROM: Final = 1 << 16  # bytes; of chunk indexes, which pack to 40 %


class PackedRecords:
    """Bytes in the order in which they were added; all but the newest are compressed.

    Attributes:
        count: how many records were added.
        size: bytes in all of them, unpacked.
    """

    def __init__(self) -> None:
        self._packed: list[bytes] = []
        self._newest: list[bytes] = []
        self._waiting = 0  # bytes of the newest
        self.count = 0
        self.size = 0

    def append(self, record: bytes) -> None:
        """Add a record."""
        self._newest.append(record)
        self._waiting += len(record)
        self.count += 1
        self.size += len(record)
        if self._waiting >= _PACKED_FROM:
            self._packed.append(zlib.compress(b"".join(self._newest)))
            self._newest, self._waiting = [], 0

    def __iter__(self) -> Iterator[bytes]:
        """All bytes, in pieces of one or many records."""
        yield from map(zlib.decompress, self._packed)
        yield from self._newest
