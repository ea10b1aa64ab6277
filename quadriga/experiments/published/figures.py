"""The figures of an experiment, each with 95 % intervals: the same results give the same bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadriga.experiments.campaign.analysis import COST
from quadriga.experiments.campaign.sheets import number
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.measures import MEASURES, Interval, ratio
from quadriga.experiments.published.results import Results
from quadriga.experiments.published.summarise import POOLED

_COLOURS: Final = (
    "#1f77b4",
    "#d62728",
    "#2ca02c",
    "#9467bd",
    "#ff7f0e",
    "#17becf",
    "#8c564b",
    "#e377c2",
    "#7f7f7f",
    "#bcbd22",
    "#000000",
)
_WIDTH: Final = 10.0  # inch
_DPI: Final = 90
_ABREAST: Final = 6  # panels whose titles have room beside each other

Point = tuple[str, str, str, str, Interval]  # row, colour, variant, measure, what is drawn


def draw(name: str, experiment: Experiment, results: Results, path: Path) -> bool:
    """Write a figure, one of `FIGURES`; False if there is nothing to draw yet."""
    figure = FIGURES[name](experiment, results)
    if figure is None:
        return False
    FigureCanvasAgg(figure)
    # Without the version of what drew it, which would be the only thing to change now and then.
    figure.savefig(path, format="png", dpi=_DPI, metadata={"Software": None})
    return True


def _success(experiment: Experiment, results: Results) -> Figure | None:
    """For each world a row for each variant: its rate of success."""
    names = [variant.name for variant in experiment.variants]
    panels = _panels(experiment, results, ["success"], names)
    return _rows(panels, "success [%]", experiment)


def _falls(experiment: Experiment, results: Results) -> Figure | None:
    """For each world a row for each variant: its fall rate less that of the baseline."""
    panels = _panels(experiment, results, ["fall-difference"], experiment.others())
    across = f"fall rate less that of {experiment.baseline} [points]"
    return _rows(panels, across, experiment, at=0.0)


def _ratios(experiment: Experiment, results: Results) -> Figure | None:
    """For each world rows of errors over those of the baseline, of every other variant."""
    measures = [ratio(name) for name in experiment.published.ratios]
    panels = _panels(experiment, results, measures, experiment.others())
    what = "RMSE, or control cost," if COST in experiment.published.ratios else "RMSE"
    across = f"{what} over that of {experiment.baseline}"
    return _rows(panels, across, experiment, at=1.0)


def _swept(experiment: Experiment, results: Results) -> Figure | None:
    """A panel for each scenario: success of every variant against what is swept in it."""
    parts = [part for part in experiment.parts if part.sweep is not None]
    figure = Figure(figsize=(_WIDTH, 3.3), layout="constrained")
    axes = figure.subplots(1, max(len(parts), 1), squeeze=False, sharey=True)[0]
    colours = _colours(experiment).items()
    drawn = False
    for part, panel in zip(parts, axes, strict=False):
        for aside, (name, colour) in zip(_asides(part, experiment), colours, strict=True):
            points = []
            for world in part.worlds():
                line = results.find(world, name)
                found = None if line is None else MEASURES["success"].of(line)
                if found is not None:
                    points.append((number(world[1]) + aside, found))
            if points:
                drawn = True
                panel.errorbar(
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
        panel.set_title(part.folder, loc="left", fontsize="medium")
        panel.set_xlabel(part.axis)
        panel.set_ylim(-3.0, 103.0)
        _clean(panel, "both")
    axes[0].set_ylabel("success [%]")
    if not drawn:
        return None
    handles, labels = max((panel.get_legend_handles_labels() for panel in axes), key=_length)
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels), frameon=False)
    return figure


FIGURES: Final[Mapping[str, Callable[[Experiment, Results], Figure | None]]] = {
    "success": _success,
    "falls": _falls,
    "ratios": _ratios,
    "sweep": _swept,
}


def _asides(part: Part, experiment: Experiment) -> list[float]:
    """How far each variant is drawn beside the swept value, so that none hides another."""
    values = [number(world[1]) for world in part.worlds()]
    step = 0.012 * (max(values) - min(values))
    count = len(experiment.variants)
    return [step * (k - (count - 1) / 2) for k in range(count)]


def _panels(
    experiment: Experiment, results: Results, measures: Sequence[str], names: Sequence[str]
) -> dict[tuple[str, ...], list[Point]]:
    """Of each world what there is to draw; rows are variants, or measures if there are several."""
    found: dict[tuple[str, ...], list[Point]] = {}
    colours = _colours(experiment)
    for world in (*experiment.worlds(), POOLED):
        for measure in measures:
            for name in names:
                line = results.find(world, name)
                estimate = None if line is None else MEASURES[measure].of(line)
                if estimate is None:
                    continue
                if len(measures) > 1:
                    row = measure.removeprefix("ratio-")
                    row = row if len(names) == 1 else f"{row}  {name}"
                else:
                    row = name
                found.setdefault(world, []).append((row, colours[name], name, measure, estimate))
    return found


def _rows(
    panels: Mapping[tuple[str, ...], Sequence[Point]],
    across: str,
    experiment: Experiment,
    at: float | None = None,
) -> Figure | None:
    """Panels that share their rows; a line at `at`, a dotted one at each limit."""
    if not panels:
        return None
    rows = list(dict.fromkeys(row for points in panels.values() for row, *_ in points))
    lines = math.ceil(len(panels) / _ABREAST)
    height = 0.4 + lines * (0.6 + 0.24 * max(len(rows), 2))
    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
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
        for row, colour, variant, measure, estimate in points:
            place = rows.index(row)
            for limit in _limits(experiment, variant, measure, world):
                required = True
                panel.plot([limit, limit], [place - 0.45, place + 0.45], color="0.1", ls=":")
            below, above = _reach(estimate)
            panel.errorbar(
                [estimate.value],
                [place],
                xerr=[[below], [above]],
                color=colour,
                marker="o",
                markersize=4,
                linewidth=1.3,
                capsize=2,
            )
        panel.set_title(" · ".join(world), loc="left", fontsize="medium")
        _clean(panel, "x")
    axes[0].set_yticks(range(len(rows)), rows)
    axes[0].set_ylim(len(rows) - 0.5, -0.5)
    dots = "; dotted: required" if required else ""
    figure.supxlabel(f"{across}, with 95 % intervals{dots}", fontsize="medium")
    return figure


def _limits(
    experiment: Experiment, variant: str, measure: str, world: tuple[str, ...]
) -> Iterator[float]:
    """What is required of a variant's figure in a world."""
    for asked in experiment.requirements:
        if asked.measure == measure and variant in asked.variants and not asked.moonshot:
            there = asked.each and world[0] in (asked.scenarios or (world[0],))
            if asked.pooled if world == POOLED else there:
                yield asked.limit


def _reach(found: Interval) -> tuple[float, float]:
    """How far the interval reaches below and above."""
    low = found.value if found.low is None else found.low
    high = found.value if found.high is None else found.high
    return max(0.0, found.value - low), max(0.0, high - found.value)


def _colours(experiment: Experiment) -> dict[str, str]:
    """Of each variant the colour that it has in every figure of the experiment."""
    names = (variant.name for variant in experiment.variants)
    return {name: _COLOURS[k % len(_COLOURS)] for k, name in enumerate(names)}


def _length(handles: tuple[Sequence[object], Sequence[str]]) -> int:
    return len(handles[1])


def _clean(panel: Axes, axis: str) -> None:
    panel.grid(axis="both" if axis == "both" else "x", color="0.9", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
