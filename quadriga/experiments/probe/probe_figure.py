"""The figure of a probe: responses over time, true and predicted, and errors by phase."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadriga.charts.colours import LINES, series_colour
from quadriga.charts.draw import tidy_axes
from quadriga.charts.files import save_png
from quadriga.experiments.probe.outcome import ProbeOutcome
from quadriga.experiments.probe.pulses import DIRECTIONS
from quadriga.shared.robots.conventions import OUTPUTS, Array, robot_names
from quadriga.shared.topics import SAMPLE_MS
from quadriga.tables import LABELS, UNITS

_SIZE: Final = (17.0, 8.0)  # inch


def draw_probe(outcome: ProbeOutcome, path: Path) -> None:
    """Write the figure: a column for each output; own response, a peer's, errors by phase."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    alone = outcome.config.team.robots == 1
    axes = figure.subplots(2 if alone else 3, len(OUTPUTS), sharex="row")
    for k, column in enumerate(axes.T):
        _draw_response(column[0], outcome, k, _largest(outcome.responses.y, k, own=True))
        if not alone:
            _draw_response(column[1], outcome, k, _largest(outcome.responses.y, k, own=False))
            _share_limits(column[:2])
        _draw_errors(column[-1], outcome, k)
        for panel in column:
            tidy_axes(panel)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    figure.suptitle(
        "Largest responses to pulses of force, true and predicted, and errors by phase of the gait",
        x=0.01,
        ha="left",
        weight="bold",
    )
    save_png(figure, path)


def _largest(y: Array, output: int, *, own: bool) -> tuple[int, int, int, int]:
    """Phase, pulsed robot, direction and responding robot of the largest true response."""
    sizes = np.linalg.norm(y[..., output], axis=3)  # (P, pulsed, D, responding)
    pairs = np.eye(sizes.shape[1], dtype=np.bool_)
    sizes = np.where((pairs if own else ~pairs)[:, None, :], sizes, -1.0)
    p, j, d, i = (int(k) for k in np.unravel_index(sizes.argmax(), sizes.shape))
    return p, j, d, i


def _share_limits(panels: Sequence[Axes]) -> None:
    """Give panels one scale, so that it shows how large a peer's response is."""
    limits = np.array([panel.get_ylim() for panel in panels])
    for panel in panels:
        panel.set_ylim(limits[:, 0].min(), limits[:, 1].max())


def _draw_response(
    axes: Axes, outcome: ProbeOutcome, output: int, pulse: tuple[int, int, int, int]
) -> None:
    p, j, d, i = pulse
    names, true = robot_names(outcome.config.team.robots), outcome.responses.y
    factor = UNITS[OUTPUTS[output]][1]
    ahead = SAMPLE_MS * np.arange(1, true.shape[3] + 1)
    axes.plot(ahead, factor * true[p, j, d, :, i, output], label="true", **LINES["true"])
    for number, each in enumerate(outcome.predictors):
        predicted = factor * each.predicted[p, j, d, :, i, output]
        axes.plot(ahead, predicted, color=series_colour(number), linewidth=1.3, label=each.name)
    axes.set_title(f"{DIRECTIONS[d]} of {names[j]} → {names[i]}", fontsize=10)
    axes.set_ylabel(LABELS[output])
    axes.set_xlabel("since the pulse began [ms]")


def _draw_errors(axes: Axes, outcome: ProbeOutcome, output: int) -> None:
    name = OUTPUTS[output]
    for number, each in enumerate(outcome.predictors):
        for figure, style in (("own_error", "-"), ("peers_error", "--")):
            errors = [phase[figure][name] for phase in each.comparison.by_phase]
            values = [np.nan if error is None else error for error in errors]
            axes.plot(outcome.phase_ms, values, style, color=series_colour(number), linewidth=1.3)
    axes.axhline(1.0, **LINES["level"])
    axes.set_ylim(0.0, 1.5)
    axes.set_title("— own, – – peers'", fontsize=10)
    axes.set_ylabel(f"relative error of {name}")
    axes.set_xlabel("phase of the gait [ms]")
