"""A lock-step recording tick by tick, whatever order the messages of several keys arrived in."""

from __future__ import annotations

from collections.abc import Container, Iterator
from typing import Final

from quadriga.shared.recording.reader import ChunkEntry, Recording

# Links differ in speed, so messages of one tick stand apart in the file, though in lock-step
# never by more than the world does while a message is under way.
_REACH: Final = 2000  # ticks


def by_tick(recording: Recording, names: Container[str]) -> Iterator[tuple[int, list[ChunkEntry]]]:
    """Ticks from 0 to the last one recorded, each with its entries in the order of the file.

    Memory is that of 2 s of world time, however long the recording is. Entries without a tick
    are left out, and so are those that a whole 2 s of others stood before.

    Args:
        recording: what to read.
        names: topics to look at, of those whose tick never runs ahead of the world's.
    """
    waiting: dict[int, list[ChunkEntry]] = {}
    due = newest = 0
    for entry in recording.entries(names):
        if entry.tick < due or entry.tick > newest + _REACH:
            continue  # without a tick, stale, or of a future that no world has reached
        waiting.setdefault(entry.tick, []).append(entry)
        newest = max(newest, entry.tick)
        while due < newest - _REACH:
            yield due, waiting.pop(due, [])
            due += 1
    while waiting:
        yield due, waiting.pop(due, [])
        due += 1
