"""The compiled pass over the bytes of a message whose numbers are all in one row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

Bytes = NDArray[np.uint8]


@compiled
def read_flat(
    payload: Bytes, head: Bytes, stamp: Bytes, tail: Bytes, spans: Array, row: Array
) -> tuple[int, int]:
    """Fill the row and return tick and stamp; −1 if the payload is not of this form.

    Args:
        payload: all bytes of a message.
        head: what precedes its tick.
        stamp: the name of its stamp, as it is written between tick and stamp.
        tail: what follows the stamp, with numbers that do not count.
        spans: where numbers begin in the tail and how many bytes they are, (fields, 2).
        row: where the numbers go.
    """
    at = len(payload) - len(tail)
    if at <= len(head) or not _same(payload, 0, head, 0, len(head)):
        return -1, -1
    tick, end = _integer(payload, len(head), at)
    named = end + len(stamp)
    if tick < 0 or named >= at or not _same(payload, end, stamp, 0, len(stamp)):
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
