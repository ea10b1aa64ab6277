"""The quick way from and to the wire, for messages whose numbers are all in one row.

The bytes of two such messages of one type differ in three things only: tick, stamp and numbers. So
one compiled pass compares the rest with a template and takes the numbers out. At 1 kHz a general
parser is dear not for what it computes but for all the code it goes through with cold caches.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import msgpack
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.jit import compiled

Bytes = NDArray[np.uint8]
_TICK: Final = b"\xa4tick"  # MessagePack's text of four bytes
_STAMP: Final = b"\xa8stamp_ns"
_STAMP_BYTES: Final = np.frombuffer(_STAMP, np.uint8)


class FlatLayout:
    """Where a type keeps what on the wire.

    Args:
        schema: its version.
        cuts: where each field's numbers are in the row, in the order of the wire.
    """

    def __init__(self, schema: int, cuts: Mapping[str, slice]) -> None:
        self._cuts = [slice(8 * cut.start, 8 * cut.stop) for cut in cuts.values()]  # bytes
        zeros = {name: bytes(8 * (cut.stop - cut.start)) for name, cut in cuts.items()}
        whole: bytes = msgpack.packb({"schema": schema, "tick": 0, "stamp_ns": 0, **zeros})
        cut = whole.index(_TICK) + len(_TICK)
        self._head, tail = whole[:cut], whole[cut + 1 + len(_STAMP) + 1 :]
        self._head_bytes = np.frombuffer(self._head, np.uint8)
        self._tail_bytes = np.frombuffer(tail, np.uint8)
        self._size = max(cut.stop for cut in cuts.values())
        self._names: list[bytes] = []  # what precedes the numbers of each field
        spans, at = [], 0  # where those begin in the tail, how many bytes they are
        for name, raw in zeros.items():
            start = at + len(msgpack.packb({name: raw})) - 1 - len(raw)
            self._names.append(tail[at:start])
            at = start + len(raw)
            spans.append((start, len(raw)))
        self._spans = np.array(spans)

    def write(self, tick: int, stamp_ns: int, row: Array) -> bytes:
        """The message's bytes, those of MessagePack."""
        raw = np.ascontiguousarray(row, "<f8").tobytes()
        parts = [self._head, msgpack.packb(tick), _STAMP, msgpack.packb(stamp_ns)]
        for name, cut in zip(self._names, self._cuts, strict=True):
            parts += (name, raw[cut])
        return b"".join(parts)

    def read(self, payload: bytes) -> tuple[int, int, Array] | None:
        """Tick, stamp and row, or None of anything but what `write` gives for finite numbers.

        None is no judgement: the same fields in another order, for example, are a valid message.
        """
        row = np.empty(self._size)
        tick, stamp_ns = _read(
            np.frombuffer(payload, np.uint8), self._head_bytes, self._tail_bytes, self._spans, row
        )
        return None if tick < 0 else (tick, stamp_ns, row)


@compiled
def _read(payload: Bytes, head: Bytes, tail: Bytes, spans: Array, row: Array) -> tuple[int, int]:
    """Fill the row and return tick and stamp; −1 if the payload is not of this form."""
    at = len(payload) - len(tail)
    if at <= len(head) or not _same(payload, 0, head, 0, len(head)):
        return -1, -1
    tick, end = _integer(payload, len(head), at)
    named = end + len(_STAMP_BYTES)
    if tick < 0 or named >= at or not _same(payload, end, _STAMP_BYTES, 0, len(_STAMP_BYTES)):
        return -1, -1
    stamp_ns, end = _integer(payload, named, at)
    if stamp_ns < 0 or end != at:
        return -1, -1
    raw, filled, passed = row.view(np.uint8), 0, 0
    for start, size in spans:
        if not _same(payload, at + passed, tail, passed, start - passed):
            return -1, -1
        passed = start + size
        raw[filled : filled + size] = payload[at + start : at + passed]
        filled += size
    for number in row:
        if number - number != 0.0:  # NaN or infinity
            return -1, -1
    return tick, stamp_ns


@compiled
def _same(a: Bytes, start_a: int, b: Bytes, start_b: int, count: int) -> bool:
    for i in range(count):  # noqa: SIM110 - a generator does not compile
        if a[start_a + i] != b[start_b + i]:
            return False
    return True


@compiled
def _integer(payload: Bytes, at: int, stop: int) -> tuple[int, int]:
    """MessagePack's unsigned integer at `at`, and where it ends; −1 if none ends before `stop`."""
    first = int(payload[at])
    if first < 0x80:
        return first, at + 1
    if not 0xCC <= first <= 0xCF:
        return -1, at
    end = at + 1 + (1 << (first - 0xCC))
    if end > stop or (first == 0xCF and payload[at + 1] >= 0x40):  # beyond what an int64 holds
        return -1, at
    value = 0
    for i in range(at + 1, end):
        value = 256 * value + int(payload[i])
    return value, end
