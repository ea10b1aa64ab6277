"""A recording read once for what it holds: keys, times, gaps, events, and how each agent ended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from quadriga.recordings.readable import open_readable
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.errors import MessageError, RecordingError
from quadriga.shared.messages import Event, Message, Status
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import ChunkEntry, name_of
from quadriga.shared.recording.ticks import SkippedTicks, TickTrack
from quadriga.shared.topics import AGENT_EVENT, EVENT, INJECTED, STATUS, TABLE, topic_of

_DECODED: dict[str, type[Message]] = {
    EVENT.name: Event,
    AGENT_EVENT.name: Event,
    INJECTED.name: Event,
    STATUS.name: Status,
}
_TYPES = {topic.name: topic.type.__name__ for topic in TABLE}


@dataclass(frozen=True, slots=True)
class Survey:
    """What a recording holds.

    Attributes:
        path: the file.
        size: its bytes.
        metadata: what the recorder was given.
        notes: what it noted at the end.
        config: the team's configuration, None if it cannot be read.
        tracks: ticks by key, sorted.
        log_times: of the first and the last message, ns; None without messages.
        invalid: events and statuses that do not decode.
        events: in the order of the file.
        statuses: the last of each agent.
        error: why the file is not whole, None if it is.
        damages: which parts of it cannot be read.
    """

    path: Path
    size: int
    metadata: Mapping[str, str]
    notes: Mapping[str, Mapping[str, str]]
    config: Config | None
    tracks: Mapping[str, TickTrack]
    log_times: tuple[int, int] | None
    invalid: int
    events: tuple[Event, ...]
    statuses: Mapping[str, Status]
    error: RecordingError | None
    damages: tuple[str, ...]

    @property
    def world_ms(self) -> int:
        """World time from the first to the last tick of those that are not ahead of it, ms."""
        tracks = [t for key, t in self.tracks.items() if name_of(key) in ("state", "sim/truth")]
        tracks = [t for t in tracks or list(self.tracks.values()) if t.first >= 0]
        if not tracks:
            return 0
        return max(t.last for t in tracks) - min(t.first for t in tracks)


def survey(path: Path) -> Survey:
    """Read a recording, a damaged one as far as it can be read.

    Raises:
        RecordingError: no such file, an empty, a foreign one, or one of a newer version.
    """
    source, error = open_readable(path)
    try:
        config: Config | None = recorded_config(source)
    except RecordingError as wrong:
        config, error = None, error or wrong
    found = _read(source.entries(), config or Config())
    return Survey(
        path=path,
        size=path.stat().st_size,
        metadata=source.metadata,
        notes=source.notes,
        config=config,
        error=error,
        damages=tuple(source.damages),
        **found,
    )


def type_of(key: str) -> str:
    """Name of the message type of a key, "–" if the table has none."""
    return _TYPES.get(name_of(key), "–")


def _read(entries: Iterator[ChunkEntry], config: Config) -> dict[str, Any]:
    every, passed_over = periods(config), SkippedTicks(config)
    tracks: dict[str, TickTrack] = {}
    kinds: dict[str, type[Message] | None] = {}
    first = last = invalid = 0
    events: list[Event] = []
    statuses: dict[str, Status] = {}
    for key, tick, log_time, payload in entries:
        track = tracks.get(key)
        if track is None:
            track = tracks[key] = TickTrack(every.get(name_of(key), 0))
            kinds[key] = _DECODED.get(name_of(key))
        track.note(tick)
        first = min(first, log_time) if first else log_time
        last = max(last, log_time)
        passed = passed_over.find(key, payload)
        if passed is not None and passed[0] in tracks:
            tracks[passed[0]].skip(passed[1])
        kind = kinds[key]
        if kind is None:
            continue
        try:
            message: Message = decode(payload, kind)
        except MessageError:
            invalid += 1
            continue
        if isinstance(message, Event):
            events.append(message)
        elif isinstance(message, Status):
            statuses[topic_of(key)[1]] = message
    return {
        "tracks": dict(sorted(tracks.items())),
        "log_times": (first, last) if tracks else None,
        "invalid": invalid,
        "events": tuple(events),
        "statuses": dict(sorted(statuses.items())),
    }
