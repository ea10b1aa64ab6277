"""A recorded run as the page shows it: arrays over world time, and what happened when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.recordings.gaps import end_of_world
from quadriga.recordings.summary import summary_of
from quadriga.recordings.traces import Traces, read_traces
from quadriga.recordings.truth import Ticks
from quadriga.report.samples import Samples, read_samples
from quadriga.report.timeline import TimelineEntry, build_timeline
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import COMMAND, MEASUREMENT, STATE, STATUS, TRUTH

_PACED: Final = tuple(topic.name for topic in (STATE, COMMAND, MEASUREMENT, STATUS, TRUTH))
_FORGED: Final = 60_000  # ms after the configured end: later ticks are not of this world


@dataclass(frozen=True, slots=True)
class ReportedRun:
    """Everything about one run.

    Attributes:
        path: the recording.
        complete: whether its file was finished.
        samples: sensors of each robot at 100 Hz.
        timeline: what happened, in order of time.
        begin: first recorded tick, ms.
        end: last recorded tick, ms.
    """

    path: Path
    complete: bool
    traces: Traces
    summary: Mapping[str, Any]
    samples: Mapping[str, Samples]
    timeline: tuple[TimelineEntry, ...]
    begin: int
    end: int

    @property
    def has_truth(self) -> bool:
        """Whether the simulator's truth was recorded."""
        return len(self.traces.truth.tick) > 0

    def outputs_of(self, index: int) -> tuple[Ticks, Array]:
        """Ticks and outputs (·, 6) of a robot: the true ones, or else its own estimates."""
        if self.has_truth:
            return self.traces.truth.tick, self.traces.truth.y[:, index]
        own = self.traces.measurements[self.traces.robots[index]]
        return own.tick, own.y


def read_run(path: Path) -> ReportedRun:
    """Read a recording, whole or cut.

    Raises:
        RecordingError: there is none, or it is empty or foreign.
    """
    recording = Recording(path)
    return build_run(recording, read_traces(recording))


def build_run(
    recording: Recording, traces: Traces, summary: Mapping[str, Any] | None = None
) -> ReportedRun:
    """The run of a recording whose traces are read already."""
    begin, end = _find_span(traces)
    return ReportedRun(
        path=recording.path,
        complete=recording.complete,
        traces=traces,
        summary=summary_of(traces) if summary is None else summary,
        samples=read_samples(recording, traces),
        timeline=build_timeline(traces, begin, end),
        begin=begin,
        end=end,
    )


def _find_span(traces: Traces) -> tuple[int, int]:
    """First and last tick of what robots and world sent; of anything, if they sent nothing."""
    last, nothing = end_of_world(traces.config) + _FORGED, np.zeros(0, dtype=np.int64)
    for names in (_PACED, ("",)):
        of_keys = [ticks for key, ticks in traces.ticks.items() if key.endswith(names)]
        ticks = np.concatenate([nothing, *of_keys])
        ticks = ticks[ticks <= last]
        if len(ticks):
            return int(ticks.min()), int(ticks.max())
    return 0, 0
