"""A recording as pictures: what was known of the team at any tick."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar

from quadriga.recordings.traces import read_traces
from quadriga.report.timeline import STOP, build_timeline
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError, RecordingError
from quadriga.shared.messages import Measurement, Message, Plan, Reference, State, Status, Truth
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import (
    MEASUREMENT,
    PLAN,
    REFERENCE,
    SAMPLE_MS,
    STATE,
    STATUS,
    TRUTH,
    topic_of,
)
from quadriga.view.gather import begin_placement
from quadriga.view.placement import Placement
from quadriga.view.snapshot import Snapshot
from quadriga.view.team_shape import TeamShape, build_team_shape

M = TypeVar("M", bound=Message)

_KINDS: Final[dict[str, type[Message]]] = {
    topic.name: topic.type for topic in (STATE, TRUTH, MEASUREMENT, PLAN, STATUS, REFERENCE)
}
_MARKED: Final = ("push", "fall", "fault", STOP)  # kinds of a timeline's entries to jump to


@dataclass(frozen=True, slots=True)
class Bookmark:
    """Something that happened, to jump to: when, ms, and what."""

    tick: int
    text: str


class RecordedRun:
    """A recorded run, of which the newest message at a tick can be had for every tick.

    Of states, of which there are a thousand a second, one of each ten is kept.

    Attributes:
        shape: of the team.
        first, last: ticks between which pictures can be had, ms.
        marks: what happened, by time.
    """

    def __init__(self, recording: Recording) -> None:
        """Read a recording.

        Raises:
            RecordingError: it is damaged, of another version, or tells nothing of any robot.
            ConfigError: see `build_team_shape`.
        """
        self.shape: TeamShape = build_team_shape(recorded_config(recording))
        self._series = _read_series(recording)
        ends = [series.ends for (kind, _), series in self._series.items() if kind in (State, Truth)]
        if not ends:
            raise RecordingError(
                str(recording.path), "neither states nor sim/truth", "a recorded walk"
            )
        self.first, self.last = min(end[0] for end in ends), max(end[1] for end in ends)
        self._places = {} if (Truth, "") in self._series else self._find_places()
        self.marks = _read_marks(recording, self.first, self.last)

    def snapshot(self, tick: int) -> Snapshot:
        """The newest messages at a tick."""
        names = self.shape.robots
        truth = self._at(Truth, "", tick)
        fits = truth is not None and truth.robots == names and len(truth.base_pos) == len(names)
        return Snapshot(
            tick=tick,
            truth=truth if fits else None,
            reference=self._at(Reference, "", tick),
            states=self._of_robots(State, tick),
            measurements=self._of_robots(Measurement, tick),
            plans=self._of_robots(Plan, tick),
            statuses=self._of_robots(Status, tick),
            places={name: place for name in names if (place := self._place(name, tick))},
        )

    def _of_robots(self, kind: type[M], tick: int) -> dict[str, M]:
        found = {name: self._at(kind, name, tick) for name in self.shape.robots}
        return {name: message for name, message in found.items() if message is not None}

    def _at(self, kind: type[M], robot: str, tick: int) -> M | None:
        series = self._series.get((kind, robot))
        return None if series is None else series.at(tick)

    def _place(self, robot: str, tick: int) -> Placement | None:
        places = self._places.get(robot, [])
        k = bisect_right(places, tick, key=lambda place: place.tick)
        return places[k - 1] if k else None

    def _find_places(self) -> dict[str, list[Placement]]:
        """Where robots are by their own account, at each of their measurements."""
        found: dict[str, list[Placement]] = {}
        for robot in self.shape.robots:
            series = self._series.get((Measurement, robot))
            places = found[robot] = []
            for message in () if series is None else series.messages():
                begin = begin_placement(self.shape, robot, message.tick)
                places.append(places[-1].follow(message) if places else begin)
        return found


class _Series(Generic[M]):
    """Messages of one kind from one sender, which are decoded when somebody looks at them."""

    def __init__(self, kind: type[M], entries: list[tuple[int, bytes]]) -> None:
        self._kind = kind
        entries.sort(key=lambda entry: entry[0])  # stable: of several for a tick the last counts
        self._ticks = [tick for tick, _ in entries]
        self._payloads = [payload for _, payload in entries]

    @property
    def ends(self) -> tuple[int, int]:
        """The first and the last tick."""
        return self._ticks[0], self._ticks[-1]

    def at(self, tick: int) -> M | None:
        """The newest valid message at a tick; None before the first."""
        for k in range(bisect_right(self._ticks, tick) - 1, -1, -1):
            try:
                return decode(self._payloads[k], self._kind)
            except MessageError:
                continue  # as if it had been lost
        return None

    def messages(self) -> list[M]:
        """All valid ones."""
        found = (self.at(tick) for tick in dict.fromkeys(self._ticks))
        return [message for message in found if message is not None]


def _read_series(recording: Recording) -> dict[tuple[type[Message], str], _Series[Any]]:
    """By type and robot; only what the team itself may have sent."""
    config = recorded_config(recording)
    names = {"", *robot_names(config.team.robots)}
    entries: defaultdict[tuple[type[Message], str], list[tuple[int, bytes]]] = defaultdict(list)
    newest: dict[str, int] = {}
    for key, tick, _, payload in recording.entries(_KINDS):
        topic, robot = topic_of(key)
        if tick < 0 or robot not in names:
            continue
        if topic is STATE:
            sample = tick // SAMPLE_MS
            if newest.get(key) == sample:
                continue
            newest[key] = sample
        entries[topic.type, robot].append((tick, payload))
    return {found: _Series(found[0], of_one) for found, of_one in entries.items()}


def _read_marks(recording: Recording, first: int, last: int) -> tuple[Bookmark, ...]:
    timeline = build_timeline(read_traces(recording), first, last)
    return tuple(
        Bookmark(entry.tick, " ".join(filter(None, (entry.kind, entry.robot, entry.text))))
        for entry in timeline
        if entry.kind in _MARKED
    )
