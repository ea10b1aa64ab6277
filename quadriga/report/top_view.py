"""The figure of the trunks' paths from above."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from quadriga.charts.colours import LINES, PALETTE, robot_style, yoke_style
from quadriga.charts.draw import POINTS_PER_INCH, TEXT, WIDTH, add_legend, add_title, tidy_axes
from quadriga.recordings.traces import Traces
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import Array, yoke_pairs

_INSTANTS: Final = 6  # at which yokes and times are drawn
_MARGIN: Final = 0.3  # m
_HIGHEST: Final = 420.0  # points
_FRAME: Final = (58.0, 14.0, 72.0, 44.0)  # points left, right, above and below the axes
_HEAD: Final = 24.0  # points of the title
_NEAR: Final = (36.0, 14.0)  # points between the times at two instants, at least
_STRIDE: Final = 5  # samples between the points of a path


def draw_top_view(traces: Traces) -> Figure:
    """Paths of all trunks from above, and the yokes at some instants."""
    place, tick = traces.truth.base_pos[..., :2], traces.truth.tick
    ends = place if len(place) else np.zeros((1, 1, 2))
    low, high = ends.min(axis=(0, 1)) - _MARGIN, ends.max(axis=(0, 1)) + _MARGIN
    left, right, above, below = _FRAME
    scale = min((WIDTH - left - right) / (high[0] - low[0]), _HIGHEST / (high[1] - low[1]))
    width, tall = scale * (high - low)
    total = above + tall + below
    figure = Figure(figsize=(WIDTH / POINTS_PER_INCH, total / POINTS_PER_INCH))
    axes = figure.add_axes((left / WIDTH, below / total, width / WIDTH, tall / total))
    tidy_axes(axes)
    axes.grid(axis="x", color=PALETTE["grid"], linewidth=0.8)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_xlabel("x [m]", fontsize=TEXT, color=PALETTE["soft"])
    axes.set_title(
        "y [m]", loc="left", pad=5.0, fontsize=TEXT, fontweight="bold", color=PALETTE["ink"]
    )
    instants = np.unique(np.linspace(0, len(tick) - 1, min(_INSTANTS, len(tick))).astype(int))
    for i, j in yoke_pairs(traces.config.team.robots, traces.config.team.yokes):
        for k in instants:
            axes.plot(*place[k, [i, j]].T, color=PALETTE["yellow"], linewidth=1.5, zorder=1)
    for i, robot in enumerate(traces.robots):
        axes.plot(*place[::_STRIDE, i].T, label=robot, **LINES[robot_style(i)])
        axes.plot(*place[instants, i].T, "o", color=robot_colour(i), markersize=7.0)
    for point, k in zip(_space_out(place, instants, scale), instants, strict=True):
        if point is not None:
            axes.annotate(
                f"{tick[k] / 1000:.1f} s", tuple(point), (0.0, 8.0), textcoords="offset points",
                ha="center", fontsize=TEXT, color=PALETTE["soft"],
            )  # fmt: skip
    legend = [(robot_style(i), robot) for i, robot in enumerate(traces.robots)]
    if traces.config.team.robots > 1 and traces.config.team.yokes != "none":
        legend.append((yoke_style(0), "yokes, at some instants"))
    add_title(figure, "Paths of the trunks from above", 0.5 * _HEAD)
    add_legend(figure, legend, above=1.0 - _HEAD / total)
    return figure


def _space_out(place: Array, instants: NDArray[np.int64], scale: float) -> list[Array | None]:
    """The topmost trunk at each instant, or None where its time would cover the one before."""
    tops: list[Array | None] = []
    last = np.full(2, -np.inf)
    for k in instants:
        top: Array = place[k, int(np.argmax(place[k, :, 1]))]
        near = (scale * np.abs(top - last) < _NEAR).all()
        tops.append(None if near else top)
        last = last if near else top
    return tops
