"""The benchmark as a picture, with a panel for each part that was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

Part = dict[str, Any]
_COLOURS: Final = ("#1f77b4", "#e6550d", "#2ca02c", "#9467bd", "#8c564b", "#bcbd22")
_GREY: Final = "0.55"


def draw(parts: dict[str, Part], path: Path) -> Path:
    """Write the picture and return its path."""
    panels = [row for row in PANELS if row[0] in parts]
    rows = max(1, (len(panels) + 1) // 2)
    figure = Figure(figsize=(9.0, 3.2 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, squeeze=False).ravel()
    for axis, (name, panel, title) in zip(axes, panels, strict=False):
        panel(axis, parts[name])
        axis.set_title(title, fontsize=9, loc="left")
        _tidy(axis)
    for axis in axes[len(panels) :]:
        axis.set_axis_off()
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=150)
    return path


def _factor(axis: Axes, part: Part) -> None:
    rows = part["rows"]
    sizes, factors = [row["robots"] for row in rows], [row["rtf"] for row in rows]
    axis.axhline(1.0, color=_GREY, linewidth=1.0, linestyle="--")
    axis.plot(sizes, factors, "o-", color=_COLOURS[0], linewidth=1.2)
    for size, factor in zip(sizes, factors, strict=True):
        axis.annotate(
            f"{factor:.2f}", (size, factor), xytext=(4, 5), textcoords="offset points", fontsize=8
        )
    axis.set_ylim(bottom=0.0, top=1.2 * max([1.0, *factors]))
    axis.set_xticks(sizes)
    axis.set_xlabel("robots")
    axis.set_ylabel("real-time factor")


def _shares(axis: Axes, part: Part) -> None:
    """Left bars: time in one process, part by part; right bars: over the bus."""
    rows, width = part["rows"], 0.38
    place, base = np.arange(len(rows)), np.zeros(len(rows))
    labels = {"physics_us": "physics", "controllers_us": "control", "planners_us": "planning"}
    for colour, (key, label) in zip(_COLOURS, labels.items(), strict=False):
        height = 1e-3 * np.array([row["alone"][key] for row in rows])
        axis.bar(place - width / 2, height, width, base, color=colour, label=label)
        base += height
    over = 1e-3 * np.array([row["tick_us"] for row in rows])
    axis.bar(place + width / 2, over, width, color=_GREY, label="all, over the bus")
    axis.set_xticks(place, [str(row["robots"]) for row in rows])
    axis.set_xlabel("robots")
    axis.set_ylabel("one tick [ms]")


def _low_level(axis: Axes, part: Part) -> None:
    base = np.zeros(2)
    for colour, stage in zip(_COLOURS, part["hot"]["stages"], strict=False):
        width = np.array([part[name]["stages"][stage] for name in ("hot", "cold")])
        axis.barh([1, 0], width, 0.6, base, color=colour, label=stage)
        base += width
    axis.set_yticks([1, 0], ["hot", "cold"])
    axis.set_xlabel("µs, medians of the stages")
    axis.set_ylim(-0.5, 2.3)
    axis.legend(fontsize=8, frameon=False, ncols=3, loc="upper left")


def _bus(axis: Axes, part: Part) -> None:
    rows, width = part["rows"], 0.38
    place = np.arange(len(rows))
    for k, (name, label) in enumerate((("bus", "bus"), ("socket", "sockets"))):
        at = place + (k - 0.5) * width
        median = np.array([row[name]["median"] for row in rows])
        axis.bar(at, median, width, color=(_COLOURS[0], _GREY)[k], label=label)
    axis.set_xticks(place, [str(row["robots"]) for row in rows])
    axis.set_xlabel("robots")
    axis.set_ylabel("one tick [µs]")


def _world(axis: Axes, part: Part) -> None:
    rows = part["rows"]
    names = [f"{row['robots']} {row['terrain']}" for row in rows]
    axis.barh(names[::-1], [row["median"] for row in rows][::-1], 0.6, color=_COLOURS[0])
    axis.set_xlabel("µs")


def _memory(axis: Axes, part: Part) -> None:
    """Private memory of the processes of the largest team."""
    row = max(part["rows"], key=lambda row: row["robots"])
    memory = {name: m for name, m in row["memory_mb"].items() if m}
    names = list(memory)[::-1]
    axis.barh(names, [memory[name]["rss"] for name in names], 0.6, color="0.85", label="resident")
    axis.barh(
        names,
        [memory[name]["pss"] for name in names],
        0.6,
        color=_COLOURS[0],
        label="its share of it",
    )
    axis.set_xlabel(f"MB, while {row['robots']} walk")


def _tidy(axis: Axes) -> None:
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(color="0.92", linewidth=0.6)
    axis.set_axisbelow(True)
    if axis.get_legend() is None and axis.get_legend_handles_labels()[0]:
        axis.legend(fontsize=8, frameon=False)
    if axis.get_ylabel():
        axis.yaxis.set_major_locator(MaxNLocator(5))


PANELS: Final = (
    ("walks", _factor, "walks over the bus, recorded"),
    ("walks", _shares, "in one process, and over the bus"),
    ("low-level", _low_level, "a robot's tick, low level"),
    ("bus", _bus, "messages alone, states and commands"),
    ("world", _world, "a step of the world, by robots"),
    ("walks", _memory, "memory"),
)
