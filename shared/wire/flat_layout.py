"""The quick way from and to the wire, for messages whose numbers are all in one row.

The bytes of two such messages of one type differ in three things only: tick, stamp and numbers. So
one compiled pass compares the rest with a template and takes the numbers out. At 1 kHz a general
parser is dear not for what it computes but for all the code it goes through with cold caches.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Final

import msgpack
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array

Bytes = NDArray[np.uint8]
Read = Callable[[Bytes, Bytes, Bytes, Bytes, Array, Array], tuple[int, int]]
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
        tick, stamp_ns = _compiled_read()(
            np.frombuffer(payload, np.uint8),
            self._head_bytes,
            _STAMP_BYTES,
            self._tail_bytes,
            self._spans,
            row,
        )
        return None if tick < 0 else (tick, stamp_ns, row)


@cache
def _compiled_read() -> Read:
    """The pass over the bytes. Only who reads such messages waits until the compiler is imported.

    Operator, recorder, router and emergency stop do not.
    """
    from quadriga.shared.wire.flat_bytes import read_flat

    return read_flat
