"""Records that are packed while they wait are the same afterwards."""

from __future__ import annotations

import struct
import tracemalloc

from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.recording.packed_records import PackedRecords


@given(st.lists(st.binary(max_size=9_000), max_size=40))
def test_what_was_added_comes_back(records: list[bytes]) -> None:
    kept = PackedRecords()
    for record in records:
        kept.append(record)
    assert b"".join(kept) == b"".join(records)
    assert (kept.count, kept.size) == (len(records), sum(map(len, records)))


def test_the_indexes_of_hours_take_little_memory() -> None:
    """An index of a chunk has its place and time, and where each of 25 channels begins in it."""
    kept = PackedRecords()
    tracemalloc.start()
    for number in range(72_000):  # an hour of chunks of 50 ms
        place = 40_000 * number
        words = [place, 10**18 + number * 50_000_000, *range(place, place + 37_500, 1_500)]
        kept.append(struct.pack("<27Q", *words))
    used, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept.size > 15_000_000
    assert used < kept.size / 2
