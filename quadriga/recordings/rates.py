"""How often the messages of each key come, by world time and by the wall clock."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.recording.reader import ChunkEntry, name_of
from quadriga.shared.recording.ticks import SkippedTicks, TickTrack
from quadriga.tables import NOTHING, align_columns, format_number

_HEADS = ("key", "messages", "per world s", "world ms", "per wall s", "wall ms", "lost")


@dataclass(slots=True)
class KeyRate:
    """Messages of one key and the intervals between them, since the last restart.

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
        self.walls = _widen(self.walls, 1e-6 * (wall_ns - self.last[1]))
        if tick >= 0 and self.last[0] >= 0:
            self.ticks = _widen(self.ticks, tick - self.last[0])
        self.last = (tick if tick >= 0 else self.last[0]), wall_ns


@dataclass(frozen=True, slots=True)
class RateFigures:
    """How often the messages of one key came.

    Attributes:
        key: theirs.
        messages: how many came since the last restart.
        per_world_s, per_wall_s: messages a second of world time, and of the wall clock; None where
            it takes two messages to tell.
        lost: messages that did not come, since the first one.
    """

    key: str
    messages: int
    per_world_s: float | None
    per_wall_s: float | None
    lost: int


class Rates:
    """The rate of every key.

    Args:
        config: the team's configuration.
    """

    def __init__(self, config: Config) -> None:
        self._periods, self._passed_over = periods(config), SkippedTicks(config)
        self._rates: dict[str, KeyRate] = {}
        self._tracks: dict[str, TickTrack] = {}

    def add(self, entry: ChunkEntry) -> None:
        """One more message."""
        track = self._tracks.get(entry.key)
        if track is None:
            track = TickTrack(self._periods.get(name_of(entry.key), 0))
            self._tracks[entry.key] = track
        track.note(entry.tick)
        passed = self._passed_over.find(entry.key, entry.payload)
        if passed is not None and passed[0] in self._tracks:
            self._tracks[passed[0]].skip(passed[1])
        rate = self._rates.get(entry.key)
        if rate is None:
            at = entry.tick, entry.log_time_ns
            self._rates[entry.key] = KeyRate(1, at, at)
        else:
            rate.add(entry.tick, entry.log_time_ns)

    @property
    def empty(self) -> bool:
        """Whether no message has come yet."""
        return not self._rates

    def restart(self) -> None:
        """Count anew, each key from its last message on; what is lost stays counted."""
        self._rates = {key: KeyRate(0, rate.last, rate.last) for key, rate in self._rates.items()}

    def figures(self) -> tuple[RateFigures, ...]:
        """Of each key, sorted."""
        return tuple(
            _figures_of(key, self._rates[key], self._tracks[key].lost)
            for key in sorted(self._rates)
        )

    def format_table(self) -> list[str]:
        """A line for each key: rates, shortest and longest intervals, what is lost."""
        rows = [_format_row(of, self._rates[of.key]) for of in self.figures()]
        return align_columns([_HEADS, *rows], right=range(1, 7), indent="")


def _figures_of(key: str, rate: KeyRate, lost: int) -> RateFigures:
    world = rate.last[0] - rate.first[0]
    wall = 1e-6 * (rate.last[1] - rate.first[1])
    return RateFigures(
        key, rate.count, _per_second(rate.steps, world), _per_second(rate.steps, wall), lost
    )


def _per_second(steps: int, ms: float) -> float | None:
    return 1000 * steps / ms if steps and ms > 0 else None


def _format_row(of: RateFigures, rate: KeyRate) -> tuple[str, ...]:
    return (
        of.key,
        f"{of.messages:,}",
        format_number(of.per_world_s, ".1f"),
        _format_span(rate.ticks, ".0f"),
        format_number(of.per_wall_s, ".1f"),
        _format_span(rate.walls, ".1f"),
        f"{of.lost:,}",
    )


def _format_span(between: tuple[float, float] | None, digits: str) -> str:
    return NOTHING if between is None else f"{between[0]:{digits}} – {between[1]:{digits}}"


def _widen(between: tuple[float, float] | None, value: float) -> tuple[float, float]:
    low, high = between or (value, value)
    return min(low, value), max(high, value)
