"""A recording for Rerun as it grows: entities that stay, and entities over world time."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from quadriga.recordings.truth import Ticks

TIME: Final = "world_time"  # a duration: seconds since the world began
TICK: Final = "tick"  # a sequence: the same in ms
_APPLICATION: Final = "quadriga"


class RerunLog:
    """Gathers what is logged; Rerun's own file writer would only warn of a full disk."""

    def __init__(self, recording: str, name: str) -> None:
        """Begin a recording.

        Args:
            recording: by which Rerun tells it from others.
            name: which Rerun shows.
        """
        self._stream = rr.RecordingStream(_APPLICATION, recording_id=recording)
        self._bytes = rr.binary_stream(self._stream)
        self._stream.send_recording_name(name)

    def keep(self, path: str, *archetypes: Any) -> None:
        """Log what holds at all times."""
        for archetype in archetypes:
            self._stream.log(path, archetype, static=True, strict=True)

    def over_time(self, path: str, ticks: Ticks, columns: Any) -> None:
        """Log columns with one row for each tick; without ticks, nothing."""
        if len(ticks):
            times = [
                rr.TimeColumn(TICK, sequence=ticks),
                rr.TimeColumn(TIME, duration=(1_000_000 * ticks).astype("timedelta64[ns]")),
            ]
            self._stream.send_columns(path, indexes=times, columns=columns, strict=True)

    def scalar(self, path: str, ticks: Ticks, values: Any) -> None:
        """Log one number for each tick; those that are not known leave a gap."""
        self.over_time(path, ticks, rr.Scalars.columns(scalars=np.asarray(values, dtype=float)))

    def arrange(self, blueprint: rrb.Blueprint) -> None:
        """Say which views Rerun shows when it opens the recording."""
        self._stream.send_blueprint(blueprint, make_active=True, make_default=True)

    def save(self, path: Path) -> None:
        """Write all that was logged: in one piece, for each that is read gets an index of its own.

        Raises:
            OSError: the file cannot be written.
        """
        path.write_bytes(self._bytes.read() or b"")
