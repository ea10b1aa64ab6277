"""SHELL of `quadriga view RUN`: a recording in the browser, played as one likes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from quadriga.playback.transport import Transport
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import Rate, monotonic
from quadriga.shared.topics import SAMPLE_MS
from quadriga.view.controls import Controls
from quadriga.view.curves import ticks_before
from quadriga.view.port import PageAddress, url_of
from quadriga.view.readings import read_outputs
from quadriga.view.recorded import RecordedRun
from quadriga.view.stage import FRAME_S, TeamStage
from quadriga.view.viser_server import open_server


def view_recording(
    path: Path, address: PageAddress, stopped: Callable[[], bool], say: Callable[[str], None]
) -> None:
    """Show a recording until this is stopped.

    Args:
        path: of the recording.
        address: of the web server.
        stopped: whether to stop.
        say: tells the user where to look.

    Raises:
        RecordingError: there is none, or nothing can be shown of it.
        ConfigError: the port is in use, or what it takes to draw the robots is missing.
    """
    recording = Recording(path)
    with open_server(address, f"quadriga · {path}") as server:
        run = RecordedRun(recording)
        stage = TeamStage(server, run.shape)
        step_ms = SAMPLE_MS * run.shape.config.planner.applied
        ends = run.first, run.last
        controls = Controls(server, stage.panels.controls, ends, run.marks, step_ms)
        cut = f" ({recording.cut})" if recording.cut else ""
        say(f"{path}{cut} in the browser: {url_of(server.get_port(), address.host)}")
        _play(run, stage, controls, stopped)


def _play(
    run: RecordedRun, stage: TeamStage, controls: Controls, stopped: Callable[[], bool]
) -> None:
    rate = Rate(FRAME_S)
    position = float(run.first)
    transport = Transport(1.0, position, monotonic(), paused=False)
    while not stopped():
        rate.wait()
        now = monotonic()
        if not stage.has_audience:
            transport.seek(position, now)  # it waits for whoever comes
            continue
        controls.fulfil(transport, now)
        position = transport.position(now)
        tick = round(position)
        if not stage.curves.follows(tick):
            for earlier in ticks_before(tick):
                if earlier >= run.first:
                    stage.curves.add(earlier, read_outputs(run.shape, run.snapshot(earlier)))
        state = f"recorded, {transport.rate:g} ×" + (", paused" if transport.paused else "")
        if stage.show(run.snapshot(tick), state, now):
            controls.show(transport, now)
            stage.panels.show_happenings([(m.tick, m.text) for m in run.marks if m.tick <= tick])
