"""A recording in several files: when a new one begins."""

from __future__ import annotations

from pathlib import Path

from quadriga.recorder.parts import Limits, Parts
from quadriga.shared.codec import encode
from quadriga.shared.recording.metadata import LOST
from quadriga.shared.recording.reader import Recording
from tests.manual_clock import ManualClock
from tests.shared.recording.test_reader import METADATA, state

KEY = "team/r1/state"


def parts_of(path: Path, limits: Limits, clock: ManualClock) -> Parts:
    return Parts(path, METADATA, {"state": 1}, limits, clock.monotonic, chunk_kib=16)


def test_a_new_file_begins_when_its_time_is_over(tmp_path: Path) -> None:
    clock = ManualClock()
    with parts_of(tmp_path / "run.mcap", Limits(seconds=2.0), clock) as parts:
        for tick in range(50):
            if tick != 20:  # the last of the first file
                parts.write(KEY, encode(state(tick)), tick)
            clock.now += 0.1
            parts.flush()
    assert [path.name for path in parts.paths] == ["run.mcap", "run-1.mcap", "run-2.mcap"]
    assert (parts.messages, parts.count_lost()) == (49, {KEY: 1})
    ticks = [[e.tick for e in Recording(path).entries()] for path in parts.paths]
    assert [t for part in ticks for t in part] == [k for k in range(50) if k != 20]
    notes = [Recording(path).notes[LOST] for path in parts.paths]
    assert sorted(map(str, notes)) == sorted(map(str, ({}, {KEY: "1"}, {})))


def test_without_limits_there_is_one_file(tmp_path: Path) -> None:
    clock = ManualClock()
    with parts_of(tmp_path / "run.mcap", Limits(), clock) as parts:
        for tick in range(500):
            parts.write(KEY, encode(state(tick)), tick)
            clock.now += 10.0
            parts.flush()
    assert parts.paths == [tmp_path / "run.mcap"]
    assert "part" not in Recording(parts.paths[0]).metadata


def test_no_file_exceeds_its_size(tmp_path: Path) -> None:
    with parts_of(tmp_path / "run.mcap", Limits(size=150_000), ManualClock()) as parts:
        for tick in range(1000):
            parts.write(KEY, encode(state(tick)), tick)
    assert len(parts.paths) > 3
    for path in parts.paths:
        Recording(path).require_whole()
        assert path.stat().st_size <= 150_000


def test_what_a_key_misses_while_it_is_silent_for_a_whole_file_is_counted(tmp_path: Path) -> None:
    clock, other = ManualClock(), "team/r2/state"
    with parts_of(tmp_path / "run.mcap", Limits(seconds=2.0), clock) as parts:
        for tick in range(60):
            parts.write(KEY, encode(state(tick)), tick)
            if not 5 <= tick < 45:
                parts.write(other, encode(state(tick)), tick)
            clock.now += 0.1
            parts.flush()
    assert len(parts.paths) == 3
    assert parts.count_lost() == {other: 40}
