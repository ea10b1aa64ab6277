"""The figure of fit reports: held-out errors over the horizon against persistence."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from quadriga.charts.colours import PALETTE
from quadriga.charts.draw import add_beside, tidy_axes
from quadriga.charts.files import save_png
from quadriga.charts.panels import BESIDE
from quadriga.identification.fit_report import FitReport
from quadriga.shared.robot.conventions import OUTPUTS
from quadriga.shared.wire.topics import SAMPLE_MS
from quadriga.tables import LABELS, UNITS


def draw(reports: Sequence[FitReport], path: Path) -> None:
    """Write the figure of predictors of one horizon, fitted to the same data."""
    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True)
    for i, panel in enumerate(axes.flat):
        factor = UNITS[OUTPUTS[i]][1]
        for report in reports:
            errors = report.horizon
            ahead = SAMPLE_MS * np.arange(1, len(errors.rmse) + 1)
            label = f"{report.name} (refused)" if report.refused else report.name
            panel.plot(
                ahead,
                factor * errors.rmse[:, i],
                linewidth=1.3,
                label=label,
                linestyle=":" if report.refused else "-",
            )
        if reports:
            held = factor * reports[0].horizon.persistence[:, i]
            panel.plot(
                ahead,
                held,
                color=PALETTE["soft"],
                linewidth=1.0,
                linestyle="--",
                label="persistence",
            )
        panel.set_ylabel(f"RMSE {LABELS[i]}")
        panel.set_ylim(bottom=0.0)
        tidy_axes(panel)
        beside = BESIDE[i]
        if beside is not None:
            add_beside(panel, beside[0] / factor, beside[1])
    for panel in axes[-1]:
        panel.set_xlabel("ahead [ms]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    figure.suptitle(
        "Errors of predictors over the horizon, on held-out data", x=0.01, ha="left", weight="bold"
    )
    save_png(figure, path)
