"""One recording for Rerun, with the views that it opens."""

from __future__ import annotations

from pathlib import Path

from quadriga.export.columns import TickReached
from quadriga.export.rerun_curves import log_curves
from quadriga.export.rerun_log import RerunLog
from quadriga.export.rerun_scene import log_scene
from quadriga.export.rerun_views import build_blueprint
from quadriga.export.source import Source
from quadriga.recordings.traces import read_traces


def write_rerun(source: Source, out: Path, on_tick: TickReached) -> tuple[Path, ...]:
    """Write a recording for Rerun: the scene, curves, modes and events.

    What Rerun does not draw, such as joint angles, stays in the recording and in other exports.

    Args:
        source: what to write.
        out: the file; it must not exist.
        on_tick: called with each tick that was reached.

    Raises:
        OSError: the file cannot be written.
        RecordingError: the recording holds no message.
    """
    recording = source.recording
    traces = read_traces(recording)
    source.left_out.update(traces.invalid)
    began = traces.log_times[0] if traces.log_times else 0
    name = f"{recording.path.absolute().parent.name}/{recording.path.name}"
    log = RerunLog(f"{traces.config.team.name}-{began}", name)
    seen = len(traces.truth.tick) > 0
    if seen:
        log_scene(log, recording, traces, on_tick)
    log_curves(log, traces)
    log.arrange(build_blueprint(traces, seen))
    log.save(out)
    return (out,)
