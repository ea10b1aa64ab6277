"""Figures of results, each with 95 % intervals: the same results give the same bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from quadriga.charts.colours import series_colour
from quadriga.experiments.measures import MEASURES, Interval, name_ratio
from quadriga.experiments.results import COST, POOLED, Results, World
from quadriga.experiments.sweep import to_number
from quadriga.tables import error_text

_WIDTH: Final = 10.0  # inch
_ABREAST: Final = 6  # panels of rows whose titles have room beside each other
_CURVES_ABREAST: Final = 4  # panels of curves that have room beside each other

Limits = Callable[[str, str, World], Iterable[float]]  # required: variant, measure and world


@dataclass(frozen=True, slots=True)
class SweepPanel:
    """A panel of success against swept values.

    Attributes:
        title, axis: what stands above and below it.
        points: swept values, as text, and their worlds.
    """

    title: str
    axis: str
    points: Sequence[tuple[str, World]]


@dataclass(frozen=True, slots=True)
class _Point:
    """An estimate of a variant in a row of a panel."""

    row: str
    variant: str
    measure: str
    estimate: Interval


@dataclass(frozen=True, slots=True)
class FigurePart:
    """What is drawn: a figure of its own, or one of several below each other.

    Attributes:
        height: inch.
        fill: draws it.
    """

    height: float
    fill: Callable[[FigureBase], None]

    def draw(self) -> Figure:
        """A figure of it alone."""
        figure = Figure(figsize=(_WIDTH, self.height), layout="constrained")
        self.fill(figure)
        return figure


def draw_together(parts: Sequence[FigurePart]) -> Figure:
    """One figure of at least one part, the first uppermost."""
    heights = [part.height for part in parts]
    figure = Figure(figsize=(_WIDTH, sum(heights)), layout="constrained")
    places = figure.subfigures(len(parts), 1, squeeze=False, height_ratios=heights)
    for part, place in zip(parts, places.flat, strict=True):
        part.fill(place)
    return figure


def _no_limits(_variant: str, _measure: str, _world: World) -> Iterable[float]:
    return ()


def build_success(results: Results, limits: Limits = _no_limits) -> FigurePart | None:
    """For each world a row for each variant: its rate of success. None without any trial."""
    panels = _collect_points(results, ["success"], results.variants)
    return _build_rows(panels, "Walks that succeeded", "success [%]", results, limits)


def build_falls(results: Results, limits: Limits = _no_limits) -> FigurePart | None:
    """For each world a row for each variant: its fall rate less that of the baseline."""
    panels = _collect_points(results, ["fall-difference"], results.others)
    across = f"fall rate less that of {results.baseline} [points]"
    title = f"Falls against those of {results.baseline}"
    return _build_rows(panels, title, across, results, limits, at=0.0)


def build_ratios(
    results: Results, names: Sequence[str], limits: Limits = _no_limits
) -> FigurePart | None:
    """For each world rows of errors over those of the baseline, of every other variant.

    Args:
        results: what to draw.
        names: of errors, `COST` and some of `ERRORS`.
        limits: what is required.
    """
    panels = _collect_points(results, [name_ratio(name) for name in names], results.others)
    what = "RMSE, or control cost," if COST in names else "RMSE"
    across = f"{what} over that of {results.baseline}"
    title = f"Errors against those of {results.baseline}"
    return _build_rows(panels, title, across, results, limits, at=1.0)


def build_sweeps(results: Results, panels: Sequence[SweepPanel]) -> FigurePart | None:
    """Success of every variant against what is swept, in each panel. None without any trial."""
    worlds = [world for panel in panels for _, world in panel.points]
    if not any(_find_success(results, w, name) for w in worlds for name in results.variants):
        return None
    lines = math.ceil(len(panels) / _CURVES_ABREAST)
    return FigurePart(3.3 * lines, lambda figure: _fill_sweeps(figure, results, panels, lines))


def _fill_sweeps(
    figure: FigureBase, results: Results, panels: Sequence[SweepPanel], lines: int
) -> None:
    columns = math.ceil(len(panels) / lines)
    grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
    axes = list(grid.flat)
    for panel in axes[len(panels) :]:
        panel.remove()
    for axis, panel in zip(axes, panels, strict=False):
        _draw_curves(axis, panel, results)
    for row in grid:
        row[0].set_ylabel("success [%]")
    legends = [axis.get_legend_handles_labels() for axis in axes[: len(panels)]]
    handles, labels = max(legends, key=lambda legend: len(legend[1]))
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    _entitle(figure, "Success against what is made harder, with 95 % intervals")


def _draw_curves(axes: Axes, panel: SweepPanel, results: Results) -> None:
    """Curves of one panel."""
    values = [to_number(value) for value, _ in panel.points]
    step = 0.012 * (max(values) - min(values))  # beside each other, so that none hides another
    for place, (name, colour) in enumerate(_colours(results).items()):
        aside = step * (place - (len(results.variants) - 1) / 2)
        points = []
        for value, world in panel.points:
            interval = _find_success(results, world, name)
            if interval is not None:
                points.append((to_number(value) + aside, interval))
        if points:
            axes.errorbar(
                [x for x, _ in points],
                [e.value for _, e in points],
                yerr=list(zip(*(_reach(e) for _, e in points), strict=True)),
                color=colour,
                label=name,
                marker="o",
                markersize=4,
                linewidth=1.3,
                capsize=2,
            )
    axes.set_title(panel.title, loc="left", fontsize="medium")
    axes.set_xlabel(panel.axis)
    axes.set_ylim(-3.0, 103.0)
    _clean(axes, "both")


def _find_success(results: Results, world: World, variant: str) -> Interval | None:
    line = results.find(world, variant)
    return None if line is None else MEASURES["success"].of(line)


def _collect_points(
    results: Results, measures: Sequence[str], names: Sequence[str]
) -> dict[World, list[_Point]]:
    """Of each world what there is to draw; rows are variants, or measures if there are several."""
    points: dict[World, list[_Point]] = {}
    for world in (*results.worlds, POOLED):
        for measure in measures:
            for name in names:
                line = results.find(world, name)
                estimate = None if line is None else MEASURES[measure].of(line)
                if estimate is None:
                    continue
                if len(measures) > 1:
                    row = error_text(measure.removeprefix("ratio-"))
                    row = row if len(names) == 1 else f"{row}  {name}"
                else:
                    row = name
                points.setdefault(world, []).append(_Point(row, name, measure, estimate))
    return points


def _build_rows(
    panels: Mapping[World, Sequence[_Point]],
    title: str,
    across: str,
    results: Results,
    limits: Limits,
    at: float | None = None,
) -> FigurePart | None:
    """Panels that share their rows; a line at `at`, a dotted one at each limit. None of nothing."""
    if not panels:
        return None
    rows = list(dict.fromkeys(point.row for points in panels.values() for point in points))
    lines = math.ceil(len(panels) / _ABREAST)

    def fill(figure: FigureBase) -> None:
        columns = math.ceil(len(panels) / lines)
        grid = list(figure.subplots(lines, columns, squeeze=False, sharey=True, sharex=True).flat)
        axes, empty = grid[: len(panels)], grid[len(panels) :]
        for panel in empty:
            panel.remove()
        for panel in axes[-columns:]:
            panel.tick_params(labelbottom=True)  # also above an empty place
        required = False
        for (world, points), panel in zip(panels.items(), axes, strict=True):
            if at is not None:
                panel.axvline(at, color="0.6", linewidth=0.8)
            required |= _draw_points(panel, points, rows, results, limits, world)
            panel.set_title(" · ".join(world), loc="left", fontsize="medium")
            _clean(panel, "x")
        axes[0].set_yticks(range(len(rows)), rows)
        axes[0].set_ylim(len(rows) - 0.5, -0.5)
        dots = "; dotted: required" if required else ""
        figure.supxlabel(f"{across}, with 95 % intervals{dots}", fontsize="medium")
        _entitle(figure, title)

    return FigurePart(0.4 + lines * (0.6 + 0.24 * max(len(rows), 2)), fill)


def _draw_points(
    panel: Axes,
    points: Sequence[_Point],
    rows: Sequence[str],
    results: Results,
    limits: Limits,
    world: World,
) -> bool:
    """Estimates of a world, each in its row, and what is required; whether anything is."""
    colours = _colours(results)
    required = False
    for point in points:
        place = rows.index(point.row)
        for limit in limits(point.variant, point.measure, world):
            required = True
            panel.plot([limit, limit], [place - 0.45, place + 0.45], color="0.1", ls=":")
        below, above = _reach(point.estimate)
        panel.errorbar(
            [point.estimate.value],
            [place],
            xerr=[[below], [above]],
            color=colours[point.variant],
            marker="o",
            markersize=4,
            linewidth=1.3,
            capsize=2,
        )
    return required


def _entitle(figure: FigureBase, title: str) -> None:
    figure.suptitle(title, x=0.01, ha="left", weight="bold", fontsize="medium")


def _reach(interval: Interval) -> tuple[float, float]:
    """How far the interval reaches below and above."""
    low = interval.value if interval.low is None else interval.low
    high = interval.value if interval.high is None else interval.high
    return max(0.0, interval.value - low), max(0.0, high - interval.value)


def _colours(results: Results) -> dict[str, str]:
    """Of each variant the colour that it has in every figure."""
    return {name: series_colour(k) for k, name in enumerate(results.variants)}


def _clean(panel: Axes, axis: Literal["x", "both"]) -> None:
    panel.grid(axis=axis, color="0.9", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
