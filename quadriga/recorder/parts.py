"""A recording as one file or, within limits of size and time, as several whole ones."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from quadriga.shared.errors import RecordingError
from quadriga.shared.link.ticks import LinkMessage
from quadriga.shared.recording.quota import Quota
from quadriga.shared.recording.reader import name_of
from quadriga.shared.recording.ticks import lost_by_key
from quadriga.shared.recording.writer import CHUNK_KIB, MESSAGE_SIZE, RecordingWriter
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import STATE


@dataclass(frozen=True, slots=True)
class Limits:
    """When a new file is begun; 0 is no limit.

    Attributes:
        size: of a file, bytes.
        seconds: of wall time in a file.
    """

    size: int = 0
    seconds: float = 0.0


class Parts:
    """The files of one recording: `run.mcap`, `run-1.mcap`, …; each can be read by itself.

    Attributes:
        paths: the files so far.
        messages: how many were written to all of them.
        quota: what is not written to any.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        periods: Mapping[str, int],
        limits: Limits = Limits(),
        now: Callable[[], float] = monotonic,
        quota: Quota | None = None,
        chunk_kib: int = CHUNK_KIB,
    ) -> None:
        """Create the first file.

        Raises:
            RecordingError: it or a later one exists, or it cannot be created.
        """
        self._metadata, self._chunk_kib, self._periods = dict(metadata), chunk_kib, periods
        self._path, self._limits, self._now = path, limits, now
        self.quota = quota or Quota()
        self._split = limits != Limits()
        if self._split:
            self._refuse_later(path)
        self.paths: list[Path] = []
        self._lost: Counter[str] = Counter()
        self._first: dict[str, int] = {}
        self._begun, self._messages = now(), 0
        self._last: dict[str, int] = {}  # tick of the newest message of each key in earlier files
        self._writer = self._create({})

    def write(self, key: str, payload: bytes, log_time_ns: int) -> None:
        """Append one message as sent."""
        self._make_room(len(payload) + MESSAGE_SIZE)
        self._writer.write(key, payload, log_time_ns)

    def write_all(self, messages: Sequence[LinkMessage]) -> None:
        """Append messages of a plant link."""
        self._make_room(sum(MESSAGE_SIZE + len(message.payload) for message in messages))
        self._writer.write_all(messages)

    def _make_room(self, size: int) -> None:
        """Begin a new file where so many bytes more would be too many."""
        most = self._limits.size
        if most and self._writer.messages and self._writer.size + size > most:
            self._begin_next()

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Write down something about the recording in the file that is open."""
        self._writer.note(name, values)

    def flush(self) -> None:
        """Let what was written so far survive a kill; begin a new file if it is time to."""
        seconds = self._limits.seconds
        if seconds and self._now() - self._begun >= seconds:
            self._begin_next()
        else:
            self._writer.flush()

    def finish(self) -> None:
        """Finish the last file."""
        self._writer.finish()

    @property
    def messages(self) -> int:
        """How many were written to all files."""
        return self._messages + self._writer.messages

    def skip(self, key: str, count: int) -> None:
        """Of a key's missing messages `count` were never sent."""
        track = self._writer.tracks.get(key)
        if track is not None:
            track.skip(count)

    def count_lost(self) -> dict[str, int]:
        """By key, messages that did not come, of all files."""
        return dict(sorted((self._lost + Counter(lost_by_key(self._writer.tracks))).items()))

    def first_ticks(self) -> dict[str, int]:
        """Tick of the first message of each key."""
        return self._first_of_part() | self._first

    @property
    def ticks(self) -> dict[str, int]:
        """Tick of the newest message of each key."""
        return {**self._last, **{key: track.last for key, track in self._writer.tracks.items()}}

    def last_tick(self) -> int:
        """Of the newest state of any robot; −1 without one."""
        states = (tick for key, tick in self.ticks.items() if name_of(key) == STATE.name)
        return max(states, default=-1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.finish()

    def _first_of_part(self) -> dict[str, int]:
        return {key: track.first for key, track in self._writer.tracks.items()}

    def _begin_next(self) -> None:
        before = self._writer
        self._first = self._first_of_part() | self._first
        before.finish()
        self._messages += before.messages
        self._lost += Counter(lost_by_key(before.tracks))
        self._begun = self._now()
        # Also of a key that was silent for a whole part: what it then misses was lost.
        self._last |= {key: track.last for key, track in before.tracks.items()}
        self._writer = self._create(self._last)

    def _create(self, after: Mapping[str, int]) -> RecordingWriter:
        number = len(self.paths)
        stem = f"{self._path.stem}-{number}" if number else self._path.stem
        path = self._path.with_name(stem + self._path.suffix)
        about = self._metadata | ({"part": str(number)} if self._split else {})
        writer = RecordingWriter(
            path, about, self._chunk_kib, periods=self._periods, after=after, quota=self.quota
        )
        self.paths.append(path)
        return writer

    @staticmethod
    def _refuse_later(path: Path) -> None:
        name = re.compile(re.escape(path.stem) + r"-\d+" + re.escape(path.suffix))
        if path.parent.is_dir():
            for other in path.parent.iterdir():
                if name.fullmatch(other.name):
                    raise RecordingError(
                        str(other),
                        "a file that exists",
                        "room for the parts of a new recording",
                        "recordings are never overwritten",
                    )
