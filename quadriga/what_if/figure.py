"""The figure of a branch: heights, speeds and tilts of the recorded walk and of the other one."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.charts.colours import truth_style
from quadriga.charts.draw import draw_panels
from quadriga.charts.files import save_png
from quadriga.charts.panels import DEGREES, Curve, Mark, Panel, PanelGrid
from quadriga.recordings.truth import TruthTrace
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.robots.conventions import Array
from quadriga.what_if.outcome import WalkCourse

_RECORDED, _BRANCH = "true", "planned"  # styles
_ASIDE: Final = 0.5  # s shown before the moment
_QUANTITIES: Final = (  # title, least span, unit that is read beside its own, of one robot
    ("trunk's height [m]", 0.1, None),
    ("forward speed [m/s]", 0.5, None),
    ("tilt [rad]", 0.3, DEGREES),
)


def draw_branch(
    walks: tuple[WalkCourse, WalkCourse],
    robots: tuple[str, ...],
    moment: int,
    path: Path,
    title: str,
) -> None:
    """Write it: a column for each robot.

    Args:
        walks: the recorded one and the other one.
        robots: their names.
        moment: where the walks part, ms.
        path: of the picture.
        title: what is different, in words.

    Raises:
        RecordingError: it cannot be written.
    """
    recorded, branch = walks
    panels = [
        Panel(
            f"{robot}: {name}",
            [
                Curve(trace.tick / 1000, _values(trace, index)[row], style)
                for trace, style in ((recorded.truth, truth_style(index)), (branch.truth, _BRANCH))
            ],
            span=span,
            beside=beside,
        )
        for row, (name, span, beside) in enumerate(_QUANTITIES)
        for index, robot in enumerate(robots)
    ]
    begin = max(0.0, 1e-3 * moment - _ASIDE)
    end = 1e-3 * float(max(course.truth.tick[-1] for course in (recorded, branch)))
    marks = [Mark(1e-3 * moment, "stopped", "changed")]
    marks += [Mark(at, "fall", f"{robot} falls: what if") for robot, at in branch.falls]
    marks += [Mark(at, "fall", f"{robot} falls: recorded") for robot, at in recorded.falls]
    grid = PanelGrid(begin, end, columns=len(robots), height=110.0)
    legend = [(_RECORDED, "recorded"), (_BRANCH, "what if")]
    with name_file_errors(RecordingError, path, "a file that can be written"):
        save_png(draw_panels(panels, grid, marks=marks, legend=legend, title=title), path)


def _values(trace: TruthTrace, index: int) -> tuple[Array, Array, Array]:
    return trace.y[:, index, 0], trace.y[:, index, 1], trace.tilt[:, index]
