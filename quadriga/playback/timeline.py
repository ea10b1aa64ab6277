"""What of a recording is played: which keys, under which names, and when."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Final, NamedTuple

from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.topics import SAMPLE_MS, STATE, TRUTH

Remap = tuple[str, str]

# Chunks of a key that Zenoh takes to publish on, without wildcards.
_KEY: Final = re.compile(r"[^/*$#?\s]+(/[^/*$#?\s]+)*")
_WORLD: Final = (f"/{STATE.name}", f"/{TRUTH.name}")  # their ticks are the world's time


class Cue(NamedTuple):
    """One message to publish when the playback comes to `at`, ms."""

    at: float
    key: str
    payload: bytes


class Timeline:
    """A recording prepared for playback.

    Attributes:
        team: the first part of every key that is played.
        first, last: when the first and the last message are due, ms of the clock that paces.
        messages: how many there are.
        step: a planning step, ms.
    """

    def __init__(
        self, recording: Recording, topics: Sequence[str], remaps: Sequence[Remap], clock: str
    ) -> None:
        """Look through the recording once.

        Args:
            recording: what to play.
            topics: patterns of keys, with or without the team.
            remaps: first parts of keys and what replaces them; the first that fits counts.
            clock: `world` paces by the world's time, which is the newest tick of a state or truth,
                `log` by the time of recording. Without states and truths it is always `log`.

        Raises:
            RecordingError: nothing is left to play.
            ConfigError: what is left would be played as several teams, or the recording's
                configuration is another version's.
        """
        config = recorded_config(recording)
        self.step = SAMPLE_MS * config.planner.applied
        self._recording, self._topics, self._remaps = recording, topics, remaps
        self._keys: dict[str, str] = {}  # as played; empty if left out
        self.messages = 0
        self._log_zero = 0
        self._by_log = False
        self.first, self.last = self._look_through(clock == "log")
        teams = sorted({key.partition("/")[0] for key in self._keys.values() if key})
        if not teams:
            known = ", ".join(sorted(self._keys)) or "no message at all"
            raise RecordingError(
                str(recording.path), f"no key that fits {' '.join(topics)}", f"some of {known}"
            )
        if len(teams) > 1:
            raise ConfigError("--remap", f"keys of the teams {', '.join(teams)}", "one team")
        self.team = teams[0]

    def cues(self, start: float) -> Iterator[Cue]:
        """Messages that are due at `start` ms or later, in the order of the file."""
        now = 0.0
        for entry in self._recording.entries():
            now = max(now, self._time(entry))
            key = self._keys[entry.key]
            if key and now >= start:
                yield Cue(now, key, entry.payload)

    def _time(self, entry: ChunkEntry) -> float:
        """The time of this entry on the clock that paces, ms; 0 if it has none."""
        if self._by_log:
            return (entry.log_time_ns - self._log_zero) / 1e6
        return max(entry.tick, 0) if entry.key.endswith(_WORLD) else 0.0

    def _look_through(self, by_log: bool) -> tuple[float, float]:
        """Learn keys, messages and clock; when the first and the last message are due, ms."""
        world = 0.0
        ends: list[tuple[float, int]] = []  # first and last, by the world and by the log
        for entry in self._recording.entries():
            if entry.key not in self._keys:
                self._log_zero = self._log_zero or entry.log_time_ns
                fits = any(_fits(entry.key, pattern) for pattern in self._topics)
                self._keys[entry.key] = rename(entry.key, self._remaps) if fits else ""
            world = max(world, self._time(entry))
            if self._keys[entry.key]:
                self.messages += 1
                ends[1:] = [(world, entry.log_time_ns)]
        self._by_log = by_log or not world
        if not ends:
            return 0.0, 0.0
        if self._by_log:
            first, last = ((log - self._log_zero) / 1e6 for _, log in (ends[0], ends[-1]))
        else:
            first, last = ends[0][0], ends[-1][0]
        return first, last


def parse_remap(text: str) -> Remap:
    """`FROM:TO`, both first parts of keys.

    Raises:
        ConfigError: not of this form.
    """
    old, colon, new = text.partition(":")
    if not (colon and _KEY.fullmatch(old) and _KEY.fullmatch(new)):
        raise ConfigError("--remap", repr(text), "FROM:TO, whole parts of keys, such as team:ghost")
    return old, new


def rename(key: str, remaps: Sequence[Remap]) -> str:
    """A key with its first parts replaced by the first of `remaps` that fits them."""
    for old, new in remaps:
        if key == old or key.startswith(f"{old}/"):
            return new + key[len(old) :]
    return key


def _fits(key: str, pattern: str) -> bool:
    return fnmatchcase(key, pattern) or fnmatchcase(key.partition("/")[2], pattern)
