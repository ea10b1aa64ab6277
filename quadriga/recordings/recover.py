"""A whole recording made of what is left of a damaged one, and an account of what is not."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from quadriga.recordings.metadata import read_counts
from quadriga.recordings.readable import config_or_default, open_readable
from quadriga.shared.config.timing import periods
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.recording.metadata import END, LOST, PROFILE
from quadriga.shared.recording.quota import Quota
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.ticks import TickTrack
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.shared.runtime.clock import wall_ns
from quadriga.tables import align_columns

RECOVERED: Final = f"{PROFILE}.recovered"
_GAPS: Final = 6  # of a key, as many are named


@dataclass(frozen=True, slots=True)
class Recovery:
    """What came of a recovery.

    Attributes:
        out: the new file.
        messages: how many are in it.
        expected: how many the recorder had written, None if the file has lost that.
        damages: what could not be read.
        tracks: ticks by key of what could.
        never_came: by key, messages that had not reached the recorder, if the file still has that.
        has_metadata: whether an intact copy of the metadata was found.
        error: why the file was not whole.
    """

    out: Path
    messages: int
    expected: int | None
    damages: tuple[str, ...]
    tracks: Mapping[str, TickTrack]
    never_came: Mapping[str, str]
    has_metadata: bool
    error: RecordingError


def recover(path: Path, out: Path | None) -> Recovery | None:
    """Write everything readable of `path` to a whole file; None if `path` is whole already.

    Args:
        path: the damaged file; it stays as it is.
        out: the new file; by default `NAME.recovered.mcap` beside it.

    Raises:
        RecordingError: nothing can be read of it, or the new file cannot be written.
    """
    source, error = open_readable(path)
    if error is None:
        return None
    if not source.metadata and next(source.entries(), None) is None:
        raise RecordingError(
            str(path),
            error.got,
            "a recording of which something is left",
            "neither a message nor the configuration can be read",
        )
    out = out or path.with_name(f"{path.stem}.recovered{path.suffix}")
    expected = periods(config_or_default(source))
    with (
        name_file_errors(RecordingError, out, "room for the recovered file"),
        RecordingWriter(
            out, source.metadata, periods=expected, quota=Quota(_all, sys.maxsize)
        ) as writer,
    ):
        for entry in source.entries():
            writer.write(entry.key, entry.payload, entry.log_time_ns)
        writer.note(RECOVERED, _describe_source(source, path))
        if END in source.notes:
            writer.note(END, source.notes[END])
    return Recovery(
        out=out,
        messages=writer.messages,
        expected=read_counts(source.notes).get("messages"),
        damages=tuple(source.damages),
        tracks=writer.tracks,
        never_came=source.notes.get(LOST, {}),
        has_metadata=bool(source.metadata),
        error=error,
    )


def _all(_key: str) -> bool:
    """All that was stored once is kept."""
    return True


def format_recovery(recovery: Recovery) -> list[str]:
    """What was recovered and what was not, line by line."""
    of = f" of {recovery.expected:,}" if recovery.expected is not None else ""
    lines = [f"{recovery.out}: {recovery.messages:,}{of} messages recovered"]
    lines += ["unreadable"] if recovery.damages else []
    lines += [f"  {damage}" for damage in recovery.damages]
    if not recovery.damages:
        lines.append("unreadable: nothing but the index or a checksum")
    if not recovery.has_metadata:
        lines.append("lost: configuration and versions, no copy of them is intact")
    missing = [
        (key, *_format_gaps(track)) for key, track in sorted(recovery.tracks.items()) if track.lost
    ]
    lines += ["missing between the first and the last message"] if missing else []
    lines += align_columns(missing, right=(1,))
    if recovery.never_came:
        every = ", ".join(f"{key} {count}" for key, count in recovery.never_came.items())
        lines.append(f"of these the recorder had never received: {every}")
    if recovery.expected is None:
        ends = [
            (key, f"tick {t.last}") for key, t in sorted(recovery.tracks.items()) if t.first >= 0
        ]
        lines += ["what came after these is lost, if anything did", *align_columns(ends)]
    return lines


def _format_gaps(track: TickTrack) -> tuple[str, str]:
    """How many messages of a key are missing, and between which ticks."""
    spans = [f"{before}–{after}" for before, after in track.gaps[:_GAPS]]
    more = len(track.gaps) - _GAPS
    text = f"between ticks {', '.join(spans)}" + (f" and {more} more" if more > 0 else "")
    return f"{track.lost:,}", text


def _describe_source(source: Recording, path: Path) -> dict[str, str]:
    return {
        "from": path.name,
        "at_ns": str(wall_ns()),
        **{f"damage.{k}": str(damage) for k, damage in enumerate(source.damages[:100])},
    }
