"""The figure of a branch: a tilt is read in degrees, too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadriga.recordings.traces import read_traces
from quadriga.shared.recording.reader import Recording
from quadriga.what_if import figure as module
from quadriga.what_if.outcome import WalkCourse


def test_degrees_stand_beside_the_tilt(known_run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    traces = read_traces(Recording(known_run / "run.mcap"))
    course, drawn = WalkCourse(traces.truth, ()), list[Figure]()
    monkeypatch.setattr(module, "save_png", lambda figure, _path: drawn.append(figure))
    module.draw_branch((course, course), traces.robots, 1500, Path("branch.png"), "nothing")
    (figure,) = drawn
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    *others, r1_tilt, r2_tilt = figure.axes
    assert not any(axes.child_axes for axes in others)
    for axes in (r1_tilt, r2_tilt):
        (beside,) = axes.child_axes
        assert "10°" in [label.get_text() for label in beside.get_yticklabels()]
