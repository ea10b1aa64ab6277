"""The figure of a changed replay: what was recorded, and what the changed agent would have sent."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.charts.draw import draw_panels
from quadriga.charts.files import save_png
from quadriga.charts.panels import BESIDE, Curve, Panel, PanelGrid
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.messages import Command, Measurement, Message, Plan
from quadriga.shared.robots.conventions import JOINT_NAMES, OUTPUTS, Array, Leg
from quadriga.shared.topics import SAMPLE_MS

_RECORDED, _RECOMPUTED, _DIFFERENCE = "true", "planned", "own"  # styles
_TINY: Final = 1e-9
_AXES: Final = "xyz"
_UNITS: Final = ("m", "m/s", "m/s", "rad", "rad", "rad/s")
_NAMES: Final = {
    "force": [f"{leg.name} f{axis} [N]" for leg in Leg for axis in _AXES],
    "plan": [f"{name} [{unit}]" for name, unit in zip(OUTPUTS, _UNITS, strict=True)],
    "output": [f"{name} [{unit}]" for name, unit in zip(OUTPUTS, _UNITS, strict=True)],
    "torque": [f"{name.removesuffix('_joint')} [N·m]" for name in JOINT_NAMES],
}
_OF_OUTPUTS: Final = ("plan", "output")
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

    def most_changed_component(self, kind: str) -> int:
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
    panels = [panel for kind in _TITLES for panel in _build_panels(curves, kind)]
    times = np.concatenate([curves.of(kind)[0] for kind in _TITLES])
    begin, end = (times.min(), times.max()) if len(times) else (0.0, 0.0)
    grid = PanelGrid(float(begin), float(end), columns=2, height=140.0)
    legend = [(_RECORDED, "recorded"), (_RECOMPUTED, "recomputed")]
    with name_file_errors(RecordingError, path, "a file that can be written"):
        save_png(draw_panels(panels, grid, legend=legend, title=title), path)


def _build_panels(curves: Curves, kind: str) -> tuple[Panel, Panel]:
    """Both values of the component that has changed most, and beside them their difference."""
    time, old, new = curves.of(kind)
    column = curves.most_changed_component(kind)
    name = f"{_TITLES[kind]}: {_NAMES[kind][column]}"
    if not len(time):
        return Panel(f"{name}, none recorded", span=1.0), Panel("", span=1.0)
    shape = "step" if kind == "force" else "line"
    both = [
        Curve(time, old[:, column], _RECORDED, shape),
        Curve(time, new[:, column], _RECOMPUTED, shape),
    ]
    beside = BESIDE[column] if kind in _OF_OUTPUTS else None
    difference = new[:, column] - old[:, column]
    worst = int(np.abs(difference).argmax())
    rms = float(np.sqrt(np.mean(difference**2)))
    size = f"at most {abs(difference[worst]):.3g}, at {time[worst]:.2f} s; rms {rms:.3g}"
    apart = f"recomputed − recorded: {size}" if difference.any() else "the same"
    gap = Panel(apart, [Curve(time, difference, _DIFFERENCE, shape)], beside=beside)
    return Panel(name, both, beside=beside), gap
