"""How often the messages of each key come, by world time and by the wall clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from quadriga.columns import NOTHING, columns
from quadriga.shared.recording.mcap_chunk import name_of
from quadriga.shared.recording.reader import ChunkEntry
from quadriga.shared.recording.sequence import TickTrack

_HEADS = ("key", "messages", "per world s", "world ms", "per wall s", "wall ms", "lost")


@dataclass(slots=True)
class Pace:
    """Intervals of one key since the last look.

    Attributes:
        count: messages.
        steps: intervals between them, and from the message before the first.
        first, last: each tick [ms] and log time [ns].
        ticks, walls: shortest and longest interval, ms.
    """

    count: int
    first: tuple[int, int]
    last: tuple[int, int]
    steps: int = 0
    ticks: tuple[float, float] | None = None
    walls: tuple[float, float] | None = None

    def add(self, tick: int, wall_ns: int) -> None:
        """One more message; a negative tick is unknown."""
        self.count += 1
        self.steps += 1
        self.walls = _widened(self.walls, 1e-6 * (wall_ns - self.last[1]))
        if tick >= 0 <= self.last[0]:
            self.ticks = _widened(self.ticks, tick - self.last[0])
        self.last = (tick if tick >= 0 else self.last[0]), wall_ns


class Paces:
    """The pace of every key.

    Args:
        periods: by a topic's name, ms between its messages.
    """

    def __init__(self, periods: Mapping[str, int]) -> None:
        self._periods = periods
        self._paces: dict[str, Pace] = {}
        self._tracks: dict[str, TickTrack] = {}

    def add(self, entry: ChunkEntry) -> None:
        """One more message."""
        track = self._tracks.get(entry.key)
        if track is None:
            track = TickTrack(self._periods.get(name_of(entry.key), 0))
            self._tracks[entry.key] = track
        track.note(entry.tick)
        pace = self._paces.get(entry.key)
        if pace is None:
            at = entry.tick, entry.log_time_ns
            self._paces[entry.key] = Pace(1, at, at)
        else:
            pace.add(entry.tick, entry.log_time_ns)

    @property
    def empty(self) -> bool:
        """Whether no message has come yet."""
        return not self._paces

    def again(self) -> None:
        """Begin anew, each key from its last message on; what is lost stays counted."""
        self._paces = {key: Pace(0, p.last, p.last) for key, p in self._paces.items()}

    def table(self) -> list[str]:
        """A line for each key: rates, shortest and longest intervals, what is lost."""
        rows = [_row(key, self._paces[key], self._tracks[key]) for key in sorted(self._paces)]
        return columns([_HEADS, *rows], right=range(1, 7), indent="")


def _row(key: str, pace: Pace, track: TickTrack) -> tuple[str, ...]:
    world = pace.last[0] - pace.first[0]
    wall = 1e-6 * (pace.last[1] - pace.first[1])
    return (
        key,
        f"{pace.count:,}",
        _rate(pace.steps, world),
        _span(pace.ticks, ".0f"),
        _rate(pace.steps, wall),
        _span(pace.walls, ".1f"),
        f"{track.lost:,}",
    )


def _rate(steps: int, ms: float) -> str:
    return f"{1000 * steps / ms:.1f}" if steps and ms > 0 else NOTHING


def _span(between: tuple[float, float] | None, digits: str) -> str:
    return NOTHING if between is None else f"{between[0]:{digits}} – {between[1]:{digits}}"


def _widened(between: tuple[float, float] | None, value: float) -> tuple[float, float]:
    low, high = between or (value, value)
    return min(low, value), max(high, value)
