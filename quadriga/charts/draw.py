"""A chart of panels that share one horizontal axis, mostly world time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator, StrMethodFormatter

from quadriga.charts.bars import draw_bars
from quadriga.charts.colours import BARS, LINES, PALETTE
from quadriga.charts.panels import LEFT, Mark, Panel, PanelGrid
from quadriga.charts.thinning import visible_points

WIDTH: Final = 1000.0  # points; a page scales it
POINTS_PER_INCH: Final = 72.0
TEXT: Final = 12.0  # points
_RIGHT, _ABOVE, _BETWEEN, _BELOW = 14.0, 20.0, 8.0, 36.0
_BESIDE: Final = 42.0  # more at the right, for values in another unit
_TITLE: Final = 14.0  # size of its letters
_ROW: Final = 15.0  # of bars
_LEGEND: Final = 24.0
_LETTER: Final = 7.0  # width of one, about
_LOG_FLOOR: Final = 1e-3
_STEPS: Final = (1, 2, 5, 10)

Legend = Sequence[tuple[str, str]]  # style and name of each entry


def draw_panels(
    panels: Sequence[Panel],
    grid: PanelGrid,
    *,
    marks: Sequence[Mark] = (),
    legend: Legend = (),
    title: str = "",
) -> Figure:
    """Panels in rows of `grid.columns`, with the marks in each of them.

    Args:
        panels: what to draw, row by row.
        grid: what the panels share.
        marks: times to mark.
        legend: entries above all panels.
        title: a line above the legend; empty for none.
    """
    rows = [panels[k : k + grid.columns] for k in range(0, len(panels), grid.columns)]
    heights = [max(_height(panel, grid) for panel in row) for row in rows]
    lines = _break_legend(legend)
    head = _LEGEND if title else 0.0
    top = head + _LEGEND * len(lines)
    total = top + sum(_ABOVE + tall + _BETWEEN for tall in heights) + _BELOW - _BETWEEN
    figure = Figure(figsize=(WIDTH / POINTS_PER_INCH, total / POINTS_PER_INCH))
    add_title(figure, title, 0.5 * head)
    for k, line in enumerate(lines):
        add_legend(figure, line, above=1.0 - (head + _LEGEND * k) / total)
    right = _RIGHT + (_BESIDE if any(panel.beside for panel in panels) else 0.0)
    width = WIDTH / grid.columns - LEFT - right
    for number, (row, tall) in enumerate(zip(rows, heights, strict=True)):
        top += _ABOVE + tall
        for k, panel in enumerate(row):
            left = LEFT + k * WIDTH / grid.columns
            place = (left / WIDTH, 1.0 - top / total, width / WIDTH, tall / total)
            axes = figure.add_axes(place)
            _fill(axes, panel, grid, (width, tall))
            # The names of marks stand beside the titles, in the first row only.
            free = _LETTER * len(panel.title) / width if number == 0 else np.inf
            _draw_marks(axes, marks, free, width)
            if number * grid.columns + k + grid.columns >= len(panels):
                across = panel.across or grid.across
                axes.set_xlabel(across, fontsize=TEXT, color=PALETTE["soft"], labelpad=2.0)
            else:
                axes.xaxis.set_major_locator(NullLocator())
        top += _BETWEEN
    return figure


def add_title(figure: Figure, title: str, below: float) -> None:
    """The title of a figure, `below` points under its upper edge; empty for none."""
    if title:
        high = 1.0 - below / (POINTS_PER_INCH * figure.get_figheight())
        figure.text(
            LEFT / WIDTH,
            high,
            title,
            va="center",
            fontsize=_TITLE,
            fontweight="bold",
            color=PALETTE["ink"],
        )


def add_legend(figure: Figure, entries: Legend, above: float = 1.0) -> None:
    """One line of entries whose upper edge is at `above`, a share of the figure's height."""
    figure.legend(
        handles=[
            Patch(facecolor=BARS[style], label=name)
            if style in BARS
            else Line2D([], [], label=name, **LINES[style])
            for style, name in entries
        ],
        loc="upper left",
        bbox_to_anchor=(LEFT / WIDTH - 0.01, above),
        ncols=len(entries),
        frameon=False,
        fontsize=TEXT,
        labelcolor=PALETTE["soft"],
        borderpad=0.2,
        columnspacing=1.5,
    )


def tidy_axes(axes: Axes) -> None:
    """Horizontal lines at round values, no frame above and at the right, small grey numbers."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(PALETTE["soft"])
    axes.grid(axis="y", color=PALETTE["grid"], linewidth=0.8)
    axes.set_axisbelow(True)
    axes.set_facecolor("none")
    axes.tick_params(left=False, labelsize=TEXT, color=PALETTE["soft"], labelcolor=PALETTE["soft"])


def _height(panel: Panel, grid: PanelGrid) -> float:
    return _ROW * len(panel.rows) if panel.rows else grid.height


def _break_legend(legend: Legend) -> list[Legend]:
    """As many lines as the entries need."""
    lines: list[list[tuple[str, str]]] = []
    used = WIDTH
    for style, name in legend:
        width = 52.0 + _LETTER * len(name)
        if used + width > WIDTH - LEFT:
            lines.append([])
            used = 0.0
        lines[-1].append((style, name))
        used += width
    return list(lines)


def _fill(axes: Axes, panel: Panel, grid: PanelGrid, size: tuple[float, float]) -> None:
    """Draw a panel; `size` is its width and height in points."""
    width, tall = size
    begin, end = panel.part or (grid.begin, grid.end)
    end = max(end, begin + 1e-3)
    tidy_axes(axes)
    if panel.rows:
        draw_bars(axes, panel, (begin, end), width)
    else:
        _draw_curves(axes, replace(panel, part=(begin, end)), grid.points, tall)
    axes.set_xlim(begin, end)
    axes.xaxis.set_major_locator(MaxNLocator(max(2, int(width // 60)), steps=_STEPS))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.set_title(  # at a fixed height: to find one takes a third of the time of a page
        panel.title, loc="left", y=1.0, pad=5.0, fontsize=TEXT, fontweight="bold",
        color=PALETTE["ink"],
    )  # fmt: skip


def _draw_curves(axes: Axes, panel: Panel, points: int, tall: float) -> None:
    """Draw the curves of a panel that has a `part`, and is `tall` points high."""
    begin, end = panel.part or (0.0, 0.0)
    low, high = find_limits(panel, begin, end)
    for curve in panel.curves:
        time, value = visible_points(curve, begin, end, points)
        if not len(time):
            continue
        if not panel.log:  # what lies far outside is drawn just outside
            value = np.clip(value, 2 * low - high, 2 * high - low)
        if curve.kind == "dots":
            colour = LINES[curve.style]["color"]
            axes.plot(time, value, linestyle="none", marker="o", markersize=4.0, color=colour)
        else:
            steps = "steps-post" if curve.kind == "step" else "default"
            axes.plot(time, value, drawstyle=steps, **LINES[curve.style])
    if panel.log:
        axes.set_yscale("log")
        subs = (1.0,) if np.log10(high / low) > 2.5 else (1.0, 2.0, 5.0)
        axes.yaxis.set_major_locator(LogLocator(subs=subs))
        axes.yaxis.set_minor_locator(NullLocator())
    else:
        axes.yaxis.set_major_locator(MaxNLocator(max(2, int(tall // 15)), steps=_STEPS))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:,.9g}"))
    axes.set_ylim(low, high)
    if panel.beside is not None:
        add_beside(axes, *panel.beside, max(2, int(tall // 25)))
    for level, name in panel.levels:
        if low < level < high:
            axes.axhline(level, **LINES["level"])
            axes.annotate(
                name, (1.0, level), (-4.0, 2.0), xycoords=("axes fraction", "data"),
                textcoords="offset points", ha="right", fontsize=TEXT, color=PALETTE["soft"],
                bbox={"facecolor": PALETTE["paper"], "edgecolor": "none", "pad": 1.0, "alpha": 0.6},
            )  # fmt: skip


def add_beside(axes: Axes, factor: float, sign: str, ticks: int = 5) -> None:
    """The same values in another unit at the right, with `ticks` numbers or fewer."""

    def convert(values: Any) -> Any:
        return factor * np.asarray(values)

    def convert_back(values: Any) -> Any:
        return np.asarray(values) / factor

    other = axes.secondary_yaxis("right", functions=(convert, convert_back))
    other.spines["right"].set_visible(False)
    other.yaxis.set_major_locator(MaxNLocator(ticks, steps=_STEPS))
    other.yaxis.set_major_formatter(StrMethodFormatter(f"{{x:g}}{sign}"))
    other.tick_params(right=False, labelsize=TEXT, labelcolor=PALETTE["soft"])


def _draw_marks(axes: Axes, marks: Sequence[Mark], free: float, width: float) -> None:
    """Lines at the marks; their names stand to the right of `free` and of one another.

    Args:
        axes: where to draw.
        marks: what to draw.
        free: share of the panel's width from which on there is room.
        width: of the panel, points.
    """
    begin, end = axes.get_xlim()
    for mark in sorted(marks, key=lambda mark: mark.time):
        if not begin <= mark.time <= end:
            continue
        axes.axvline(mark.time, **LINES[mark.style])
        at = (mark.time - begin) / (end - begin)
        if mark.name and at - _LETTER * len(mark.name) / width > free:
            axes.annotate(
                mark.name, (at, 1.0), (0.0, 5.0), xycoords="axes fraction", ha="right",
                textcoords="offset points", fontsize=TEXT, fontweight="bold",
                color=LINES[mark.style]["color"],
            )  # fmt: skip
            free = at


def find_limits(panel: Panel, begin: float, end: float) -> tuple[float, float]:
    """Least and greatest value that a panel of curves shows, with a margin."""
    shown = [np.zeros(0)]
    for curve in panel.curves:
        within = (curve.time >= begin) & (curve.time <= min(end, panel.until))
        shown.append(curve.value[within & np.isfinite(curve.value)])
    values = np.concatenate(shown)
    if panel.floor is not None:
        values = np.append(values, panel.floor)
    if not len(values):
        values = np.zeros(1)
    values = np.minimum(values, panel.ceiling)
    if panel.log:
        values = np.log10(np.maximum(values, _LOG_FLOOR))
    low, high = float(values.min()), float(values.max())
    missing = max(panel.span, 1e-9 + 1e-3 * abs(high)) - (high - low)
    if missing > 0.0:
        up = missing if panel.floor is not None else missing / 2
        low, high = low - (missing - up), high + up
    margin = 0.06 * (high - low)
    if panel.log:
        return 10.0 ** (low - margin), 10.0 ** (high + margin)
    return low - (0.0 if panel.floor is not None else margin), high + margin
