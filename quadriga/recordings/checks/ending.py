"""How a recording ends: as the plant announced it, or because something had vanished."""

from __future__ import annotations

from collections.abc import Mapping

from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.shared.messages import Event
from quadriga.shared.recording.metadata import END


class Ending:
    """A recording is complete only if it does not end because who drives time, or a link, vanished.

    One whose recorder was told to stop before the walk was over is.
    """

    def __init__(self, notes: Mapping[str, Mapping[str, str]]) -> None:
        """Of a recording with these notes, see `Recording.notes`."""
        self.finding = Finding("end", "recording", looked=1)
        self._note = notes.get(END)
        self._announced = ""

    def look(self, item: CheckedMessage) -> None:
        message = item.message
        if isinstance(message, Event) and message.kind == "stop":
            self._announced = message.code

    def finish(self) -> None:
        """Say what the end was."""
        if self._announced:
            self.finding.notes.append(f"announced: {self._announced}")
        elif self._note is None:
            self.finding.notes.append("not announced: the recorder left before")
        else:
            tick, got = self._note.get("tick", ""), self._note.get("detail", "")
            self.finding.count = "incomplete"
            self.finding.add_objection(
                int(tick) if tick.isdecimal() else -1, "", got, "an announced end of the walk"
            )
