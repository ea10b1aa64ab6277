"""The figures of a finished walk as PNG files in its run folder."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.charts.files import save_png
from quadriga.report.foot_figures import draw_forces_of_first
from quadriga.report.process_figures import draw_time_histograms
from quadriga.report.run import ReportedRun
from quadriga.report.top_view import draw_top_view
from quadriga.report.trunk_figures import draw_trajectory

TRAJECTORY: Final = "trajectory.png"
FORCES: Final = "forces.png"
TOP_VIEW: Final = "top_view.png"
TIMES: Final = "times.png"


def write_figures(run: ReportedRun, folder: Path) -> tuple[Path, ...]:
    """Write the figures of a run and return their paths."""
    figures = {
        TRAJECTORY: draw_trajectory(run, 0),
        FORCES: draw_forces_of_first(run),
        TOP_VIEW: draw_top_view(run.traces),
        TIMES: draw_time_histograms(run),
    }
    for name, figure in figures.items():
        save_png(figure, folder / name)
    return tuple(folder / name for name in figures)
