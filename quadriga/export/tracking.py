"""What a robot's trunk was to do, was estimated to do and did, side by side for plotting."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.recordings.traces import read_traces
from quadriga.recordings.tracking import track_outputs
from quadriga.recordings.truth import Ticks
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import OUTPUTS, Array
from quadriga.shared.topics import MEASUREMENT, PLAN, REFERENCE, TRUTH

NAMES: Final = (
    *(f"{what}.{output}" for what in ("true", "estimated", "planned") for output in OUTPUTS),
    *(f"reference.{name}" for name in ("vx", "vy", "wz", "height")),
)


class Tracking:
    """Rows of `NAMES` by robot and tick of its measurements; NaN where something is not known."""

    def __init__(self, recording: Recording) -> None:
        """Read what is needed of a recording.

        Raises:
            RecordingError: see `read_traces`.
        """
        names = {topic.name for topic in (TRUTH, MEASUREMENT, PLAN, REFERENCE)}
        traces = read_traces(recording, names)
        self._rows: dict[str, tuple[Ticks, Array]] = {}
        for i, robot in enumerate(traces.robots):
            of = track_outputs(traces, i)
            rows = np.concatenate([of.true, of.measured, of.planned, of.reference], axis=1)
            self._rows[robot] = of.tick, rows

    def row(self, robot: str, tick: int) -> Array | None:
        """The row of a measurement. Shape (len(NAMES),)."""
        ticks, rows = self._rows.get(robot, (np.zeros(0, dtype=np.int64), np.zeros((0, 0))))
        at = int(np.searchsorted(ticks, tick))
        return rows[at] if at < len(ticks) and ticks[at] == tick else None
