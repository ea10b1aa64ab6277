"""What lies between a recording and the one before it, whose recorder was gone for a while."""

from __future__ import annotations

from pathlib import Path

from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import STATE


class Continuation:
    """A recording goes on where the one before it ends.

    Args:
        path: of the recording.
        before: name of the file beside it that it continues.
    """

    def __init__(self, path: Path, before: str) -> None:
        self.finding = Finding("continued", "recordings", looked=1)
        self._before = path.parent / Path(before).name  # a name may come from anybody
        self._first = -1

    def look(self, item: CheckedMessage) -> None:
        if self._first < 0 and item.topic == STATE.name:
            self._first = item.message.tick

    def finish(self) -> None:
        """Count the ticks between the two files."""
        name = self._before.name
        try:
            states = Recording(self._before).entries({STATE.name})
            last = max((entry.tick for entry in states), default=-1)
        except RecordingError as error:
            self.finding.notes.append(f"what is missing after {name} is not known: {error.got}")
            return
        if self._first > last + 1:
            gap = self._first - last - 1
            self.finding.count = "a gap"
            self.finding.add_objection(
                self._first, "", f"{gap} ms missing after tick {last} of {name}", "no gap", gap
            )
