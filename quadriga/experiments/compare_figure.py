"""The figure of a comparison: a dot for each walk, so that its spread is seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadriga.experiments.compare_sheets import label
from quadriga.experiments.trial.trial import Figures, TrialResult
from quadriga.shared.robot.a1 import OUTPUTS
from quadriga.tables import LABELS

_Measure = tuple[str, Callable[[Figures], float | None]]
_SHOWN: Final = ("z", "vx", "roll")


def _rmse(name: str) -> Callable[[Figures], float | None]:
    def measure(found: Figures) -> float | None:
        value = found.rmse[name]
        return None if value is None else 1e3 * value

    return measure


_MEASURES: Final[tuple[_Measure, ...]] = (
    ("cost", lambda found: found.cost),
    *((f"RMSE {LABELS[OUTPUTS.index(name)]}", _rmse(name)) for name in _SHOWN),
)


def draw(rows: Sequence[TrialResult], path: Path) -> None:
    """Write the figure: a row of panels for each scenario, a column for each measure."""
    scenarios = list(dict.fromkeys(row.trial.scenario for row in rows))
    names = list(dict.fromkeys(map(label, rows)))
    height = 1.2 + max(1, len(scenarios)) * (0.8 + 0.27 * len(names))
    figure = Figure(figsize=(13.0, height), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(max(1, len(scenarios)), len(_MEASURES), squeeze=False, sharey=True)
    for scenario, line in zip(scenarios, panels, strict=False):
        here = [row for row in rows if row.trial.scenario == scenario]
        for (title, measure), panel in zip(_MEASURES, line, strict=True):
            _fill(panel, here, names, measure)
            panel.set_xlabel(title)
        line[0].set_title(scenario, loc="left", fontweight="bold")
        line[0].set_yticks(range(len(names)), names)
        line[0].set_ylim(len(names) - 0.5, -0.5)
    figure.supxlabel(
        "a dot for each walk, a bar at their mean; × fell or stopped, as far as it came",
        fontsize="small",
    )
    figure.savefig(path, dpi=110)


def _fill(
    panel: Axes,
    rows: Sequence[TrialResult],
    names: Sequence[str],
    measure: Callable[[Figures], float | None],
) -> None:
    panel.set_xlim(left=0.0, right=1.1 * (_reach(rows, measure) or 1.0))
    panel.grid(axis="x", color="0.9", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    edge = panel.get_xlim()[1]
    for place, name in enumerate(names):
        mine = [row for row in rows if label(row) == name]
        spread = 0.25 * np.linspace(-1.0, 1.0, len(mine)) if len(mine) > 1 else np.zeros(len(mine))
        upright = [v for row in mine if row.walked and (v := measure(row.walked)) is not None]
        if upright:
            mean = float(np.mean(upright))
            panel.plot([mean, mean], [place - 0.35, place + 0.35], color="0.6", linewidth=2.0)
        for row, shift in zip(mine, spread, strict=True):
            if row.figures is None:
                continue
            value = measure(row.figures)
            at = edge if value is None else min(value, edge)
            marker, colour = ("o", "#1f77b4") if row.walked else ("x", "#d62728")
            panel.plot(
                [at], [place + shift], marker=marker, color=colour, markersize=5, clip_on=False
            )
        if mine and all(row.refused for row in mine):
            panel.text(0.02 * edge, place, "refused", color="0.5", va="center", fontsize="small")


def _reach(rows: Sequence[TrialResult], measure: Callable[[Figures], float | None]) -> float:
    """The greatest value of a walk to the end: one that fell must not squeeze all others."""
    values = [measure(row.walked) for row in rows if row.walked]
    return max((v for v in values if v is not None), default=0.0)
