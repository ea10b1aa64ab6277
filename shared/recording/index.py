"""How many messages a finished recording has of each key, from its index: nothing else is read."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from mcap.reader import make_reader

from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.recording.mcap_chunk import CORRUPT


def indexed_counts(path: Path) -> dict[str, int] | None:
    """Messages by key, sorted; None of a file that was cut, or whose index is damaged.

    Raises:
        RecordingError: the file cannot be read.
    """
    with name_file_errors(RecordingError, path, "a recording"), path.open("rb") as file:
        try:
            summary = make_reader(file).get_summary()
        except (*CORRUPT, StopIteration):
            return None
    if summary is None or summary.statistics is None:
        return None
    counts: Counter[str] = Counter()
    for number, channel in summary.channels.items():
        counts[channel.topic] += summary.statistics.channel_message_counts.get(number, 0)
    return dict(sorted(counts.items()))
