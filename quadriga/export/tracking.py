"""What a robot's trunk was to do, was estimated to do and did, side by side for plotting."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.recordings.traces import in_force, read_traces
from quadriga.recordings.truth import Ticks
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robot.conventions import OUTPUTS, Array
from quadriga.shared.wire.topics import MEASUREMENT, PLAN, REFERENCE, SAMPLE_MS, TRUTH

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
            tick, estimated = traces.measurements[robot].tick, traces.measurements[robot].y
            begin, _, planned = join_applied_samples(
                traces.plans[robot], traces.config.planner.applied
            )
            rows = [
                _look_up(tick, traces.truth.tick, traces.truth.y[:, i]),
                estimated,
                _look_up(tick, np.rint(1000 * begin).astype(np.int64) + SAMPLE_MS, planned),
                in_force(traces.references, tick),
            ]
            self._rows[robot] = tick, np.concatenate(rows, axis=1)

    def row(self, robot: str, tick: int) -> Array | None:
        """The row of a measurement. Shape (len(NAMES),)."""
        ticks, rows = self._rows.get(robot, (np.zeros(0, dtype=np.int64), np.zeros((0, 0))))
        at = int(np.searchsorted(ticks, tick))
        return rows[at] if at < len(ticks) and ticks[at] == tick else None


def _look_up(tick: Ticks, known: Ticks, values: Array) -> Array:
    """Rows of `values` at each tick, NaN where none is known. Shape (len(tick), 6)."""
    padded = np.vstack([np.full((1, len(OUTPUTS)), np.nan), values.reshape(-1, len(OUTPUTS))])
    order = np.argsort(known, kind="stable")  # of several for one tick the last counts
    newest = np.searchsorted(known[order], tick, side="right")
    at = np.concatenate([[0], 1 + order])[newest]
    at[(at > 0) & (np.concatenate([[-1], known])[at] != tick)] = 0
    rows: Array = padded[at]
    return rows
