"""The figure of a changed replay: what was recorded and what the changed agent would have said."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from agents.sampling import SAMPLE_MS
from shared.messages import Command, Measurement, Message, Plan
from shared.robot import JOINT_NAMES, OUTPUTS, Array, Leg

_BLUE, _ORANGE, _GREY = "#1f77b4", "#e6550d", "0.75"
_AXES: Final = "xyz"
_UNITS: Final = ("m", "m/s", "m/s", "rad", "rad", "rad/s")
_NAMES: Final = {
    "force": [f"{leg.name} f{axis} [N]" for leg in Leg for axis in _AXES],
    "plan": [f"{name} [{unit}]" for name, unit in zip(OUTPUTS, _UNITS, strict=True)],
    "output": [f"{name} [{unit}]" for name, unit in zip(OUTPUTS, _UNITS, strict=True)],
    "torque": [f"{name.removesuffix('_joint')} [N·m]" for name in JOINT_NAMES],
}
_TITLES: Final = {
    "force": "planned force", "plan": "planned output", "output": "estimated output",
    "torque": "motor torque",
}  # fmt: skip


class Curves:
    """Pairs of recorded and recomputed values over world time, gathered message by message."""

    def __init__(self, applied: int) -> None:
        self._applied = applied
        self._rows: dict[str, list[tuple[float, Array, Array]]] = defaultdict(list)

    def add(self, recorded: Message, recomputed: Message) -> None:
        """One message of each, of the same type and serial."""
        time = recorded.tick / 1000.0
        if isinstance(recorded, Command) and isinstance(recomputed, Command):
            self._rows["torque"].append((time, recorded.tau, recomputed.tau))
        elif isinstance(recorded, Measurement) and isinstance(recomputed, Measurement):
            self._rows["output"].append((time, recorded.y, recomputed.y))
        elif isinstance(recorded, Plan) and isinstance(recomputed, Plan):
            for k in range(min(self._applied, len(recorded.u), len(recomputed.u))):
                at = time + 1e-3 * SAMPLE_MS * k
                self._rows["force"].append((at, recorded.u[k], recomputed.u[k]))
                self._rows["plan"].append((at, recorded.y[k], recomputed.y[k]))

    def of(self, kind: str) -> tuple[Array, Array, Array]:
        """Times (T,) [s], recorded and recomputed values (T, m), in ascending time."""
        rows = sorted(self._rows[kind], key=lambda row: row[0])
        width = len(_NAMES[kind])
        values = [np.array([row[k] for row in rows]).reshape(-1, width) for k in (1, 2)]
        return np.array([row[0] for row in rows]), values[0], values[1]

    def greatest(self, kind: str) -> tuple[float, int, float]:
        """Where the two are farthest apart: difference, place among the m values, time [s]."""
        time, old, new = self.of(kind)
        if not len(time):
            return 0.0, 0, 0.0
        apart = np.abs(new - old)
        row, column = np.unravel_index(int(apart.argmax()), apart.shape)
        return float(apart[row, column]), int(column), float(time[row])


def draw(curves: Curves, title: str, path: Path) -> None:
    """Write the figure: of each kind the component that has changed most."""
    figure = Figure(figsize=(10.0, 9.0), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(_TITLES), 1, sharex=True)
    for kind, panel in zip(_TITLES, panels, strict=True):
        _fill(panel, curves, kind)
    panels[-1].set_xlabel("time [s]")
    handles, labels = panels[-1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(title, fontsize="medium")
    figure.savefig(path, dpi=110)


def _fill(panel: Axes, curves: Curves, kind: str) -> None:
    time, old, new = curves.of(kind)
    apart, column, at = curves.greatest(kind)
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(color="0.92", linewidth=0.6)
    if not len(time):
        panel.text(0.5, 0.5, "none recorded", transform=panel.transAxes, ha="center")
        panel.set_title(_TITLES[kind], loc="left", fontsize="small")
        return
    style = "steps-post" if kind == "force" else "default"
    panel.plot(time, old[:, column], color=_BLUE, linewidth=1.4, drawstyle=style, label="recorded")
    panel.plot(time, new[:, column], color=_ORANGE, linewidth=0.9, drawstyle=style,
               label="recomputed")  # fmt: skip
    if apart:
        panel.axvline(at, color=_GREY, linewidth=1.0, zorder=0)
    rms = float(np.sqrt(np.mean((new - old)[:, column] ** 2)))
    panel.set_ylabel(_NAMES[kind][column])
    panel.set_title(
        f"{_TITLES[kind]}: at most {apart:.3g} apart, at {at:.2f} s; rms {rms:.3g}",
        loc="left", fontsize="small",
    )  # fmt: skip
