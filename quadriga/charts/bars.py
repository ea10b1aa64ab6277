"""Rows of bars: what lasted from when to when."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from quadriga.charts.colours import BARS
from quadriga.charts.panels import Panel


def draw_bars(axes: Axes, panel: Panel, span: tuple[float, float], width: float) -> None:
    """Draw the rows of a panel, the first one uppermost.

    Args:
        axes: where to draw.
        panel: what to draw.
        span: first and last time, s.
        width: of the panel, points.
    """
    axes.grid(visible=False)
    point = (span[1] - span[0]) / width
    for k, row in enumerate(panel.rows):
        for style in dict.fromkeys(style for *_, style in row.bars):
            # Bars of what is true lie as a thin line in those of what is scheduled.
            inset = 0.36 if style.endswith("contact") else 0.12
            wider = 1.5 * point if style in ("event", "trouble") else 0.0
            sides = np.array(
                [
                    (max(begin, span[0]) - wider, min(stop, span[1]) + wider)
                    for begin, stop, which in row.bars
                    if which == style and stop >= span[0] and begin <= span[1]
                ]
            ).reshape(-1, 2)
            sides[:, 1] = np.maximum(sides[:, 1], sides[:, 0] + 0.5 * point)  # can be seen
            if len(sides):
                path = _boxes(sides, k + inset, k + 1 - inset)
                axes.add_patch(PathPatch(path, facecolor=BARS[style], linewidth=0.0))
    axes.set_ylim(len(panel.rows), 0.0)
    axes.set_yticks(np.arange(len(panel.rows)) + 0.5, [row.name for row in panel.rows])


def _boxes(sides: np.ndarray, low: float, high: float) -> Path:
    """Rectangles from `low` to `high` with these left and right sides, shape (k, 2)."""
    left, right = sides.T
    edges = np.full_like(left, low), np.full_like(left, high)
    x = np.stack([left, right, right, left, left], axis=1)
    y = np.stack([edges[0], edges[0], edges[1], edges[1], edges[0]], axis=1)
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    return Path(np.stack([x.ravel(), y.ravel()], axis=1), codes * len(sides))
