"""The figure of a changed replay: what was recorded and what the changed agent would have said."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadriga.shared.errors import RecordingError
from quadriga.shared.robot.a1 import JOINT_NAMES, OUTPUTS, Array, Leg
from quadriga.shared.wire.messages import Command, Measurement, Message, Plan
from quadriga.shared.wire.topics import SAMPLE_MS

_BLUE, _ORANGE = "#1f77b4", "#e6550d"
_TINY: Final = 1e-9
_AXES: Final = "xyz"
_UNITS: Final = ("m", "m/s", "m/s", "rad", "rad", "rad/s")
_NAMES: Final = {
    "force": [f"{leg.name} f{axis} [N]" for leg in Leg for axis in _AXES],
    "plan": [f"{name} [{unit}]" for name, unit in zip(OUTPUTS, _UNITS, strict=True)],
    "output": [f"{name} [{unit}]" for name, unit in zip(OUTPUTS, _UNITS, strict=True)],
    "torque": [f"{name.removesuffix('_joint')} [N·m]" for name in JOINT_NAMES],
}
_TITLES: Final = {
    "force": "planned force",
    "plan": "planned output",
    "output": "estimated output",
    "torque": "motor torque",
}


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

    def changed_most(self, kind: str) -> int:
        """The component that is farthest off, measured by how much it varies in the recording."""
        _, old, new = self.of(kind)
        if not len(old):
            return 0
        return int((np.abs(new - old).max(axis=0) / (np.ptp(old, axis=0) + _TINY)).argmax())


def draw(curves: Curves, title: str, path: Path) -> None:
    """Write the figure: of each kind the component that has changed most, and by how much.

    Raises:
        RecordingError: it cannot be written.
    """
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(_TITLES), 2, sharex=True, width_ratios=(3, 2))
    for kind, (both, apart) in zip(_TITLES, panels, strict=True):
        _fill(both, apart, curves, kind)
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    handles, labels = panels[-1, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(title, fontsize="medium")
    try:
        figure.savefig(path, dpi=110)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RecordingError(str(path), reason, "a file that can be written") from None


def _fill(both: Axes, apart: Axes, curves: Curves, kind: str) -> None:
    time, old, new = curves.of(kind)
    column = curves.changed_most(kind)
    name, _, unit = _NAMES[kind][column].rpartition(" ")
    for panel in (both, apart):
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(color="0.92", linewidth=0.6)
    both.set_title(f"{_TITLES[kind]}: {name}", loc="left", fontsize="small")
    both.set_ylabel(unit)
    if not len(time):
        both.text(0.5, 0.5, "none recorded", transform=both.transAxes, ha="center")
        return
    style: Any = "steps-post" if kind == "force" else "default"
    for values, colour, width, label in (
        (old, _BLUE, 1.4, "recorded"),
        (new, _ORANGE, 0.9, "recomputed"),
    ):
        both.plot(
            time, values[:, column], color=colour, linewidth=width, drawstyle=style, label=label
        )
    difference = new[:, column] - old[:, column]
    apart.plot(time, difference, color="0.25", linewidth=0.9, drawstyle=style)
    worst = int(np.abs(difference).argmax())
    rms = float(np.sqrt(np.mean(difference**2)))
    apart.set_title(
        f"recomputed − recorded: at most {abs(difference[worst]):.3g}, at {time[worst]:.2f} s; "
        f"rms {rms:.3g}"
        if difference.any()
        else "the same",
        loc="left",
        fontsize="small",
    )
