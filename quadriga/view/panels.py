"""SHELL: the side panel of a view: words, curves, traffic, and what to show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import viser
from viser import uplot

from quadriga.charts.colours import LINES
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import OUTPUTS, Array
from quadriga.view import words
from quadriga.view.curves import KINDS, CurveWindow, axis_range
from quadriga.view.team_shape import TeamShape
from quadriga.view.traffic import KeyTraffic
from quadriga.view.viser_scene import ViewScene

_ALL: Final = "all, measured"
_LISTED: Final = 8  # of what happened, at a time


class _Axis(NamedTuple):
    """How an output is shown: its unit, what it is multiplied by, and steps of the axis' ends."""

    unit: str
    scale: float
    step: float


_DEGREES: Final = 180.0 / np.pi
_AXES: Final = {
    "z": _Axis("m", 1.0, 0.05), "vx": _Axis("m/s", 1.0, 0.25), "vy": _Axis("m/s", 1.0, 0.25),
    "roll": _Axis("°", _DEGREES, 5.0), "pitch": _Axis("°", _DEGREES, 5.0),
    "wz": _Axis("°/s", _DEGREES, 20.0),
}  # fmt: skip
_STYLES: Final = dict(zip(KINDS, ("own", "planned", "true"), strict=True))
_ASKED: Final = uplot.Series(
    label="asked", stroke=LINES["asked"]["color"], width=1.5, dash=(5.0, 4.0)
)


class Panels:
    """Everything beside the scene.

    Args:
        server: where.
        shape: of the team.
        scene: of which parts can be hidden.
    """

    def __init__(self, server: viser.ViserServer, shape: TeamShape, scene: ViewScene) -> None:
        self._server, self._shape, self._scene = server, shape, scene
        self._heading = server.gui.add_html("")
        self.controls = server.gui.add_folder(None)  # what a recording is played with
        tabs = server.gui.add_tab_group()
        with tabs.add_tab("team"):
            self._robots = server.gui.add_html("")
            with server.gui.add_folder("what happened"):
                self._happenings = server.gui.add_html(words.format_happenings(()))
            with server.gui.add_folder("show"):
                self._shown = {
                    name: server.gui.add_checkbox(name, initial_value=True) for name in scene.shown
                }
                server.gui.add_html(words.format_legend())
                self._follow = server.gui.add_checkbox("follow the team", initial_value=True)
        with tabs.add_tab("curves"):
            options = (_ALL, *shape.robots)
            self._choice = server.gui.add_dropdown("robot", options)
            self._folder = server.gui.add_folder(None)
        self._tabs = tabs
        self._traffic: Any = None  # a recording has none
        self._drawn = "", 0.0  # whose curves there are, and until when
        self._plots: list[Any] = []

    def show_words(self, heading: str, robots: str) -> None:
        """Show words, which are HTML."""
        self._heading.content, self._robots.content = heading, robots

    def heed_boxes(self) -> None:
        """Do what the boxes say that are ticked, and those that are not."""
        for name, box in self._shown.items():
            for node in self._scene.shown[name]:
                if node.visible != box.value:
                    node.visible = box.value
        self._scene.follows = self._follow.value

    def show_happenings(self, happenings: Sequence[tuple[int, str]]) -> None:
        """List what happened lately, by tick and text, the newest last."""
        self._happenings.content = words.format_happenings(happenings[-_LISTED:])

    def show_traffic(self, rows: Sequence[KeyTraffic]) -> None:
        """List how often messages of each key come."""
        if self._traffic is None:
            with self._tabs.add_tab("traffic"):
                self._traffic = self._server.gui.add_html("")
        self._traffic.content = words.format_traffic(rows)

    def show_curves(self, curves: CurveWindow) -> None:
        """Show curves, if they have changed or others were chosen."""
        choice, newest = self._choice.value, float(curves.seconds[-1])
        if (choice, newest) == self._drawn:
            return
        if choice != self._drawn[0]:
            self._add_plots(curves)
        self._drawn = choice, newest
        for plot, name in zip(self._plots, OUTPUTS, strict=True):
            plot.data = self._columns(curves, name)
            scales = _scales_of(plot.data, name)
            if scales != plot.scales:
                plot.scales = scales

    def _columns(self, curves: CurveWindow, name: str) -> tuple[Array, ...]:
        """Time and curves of an output, in the units that are shown."""
        output, choice = OUTPUTS.index(name), self._choice.value
        if choice == _ALL:
            time, *values = curves.of_all(output)
        else:
            time, *values = curves.of_robot(self._shape.robots.index(choice), output)
        return time.copy(), *(_AXES[name].scale * value for value in values)

    def _add_plots(self, curves: CurveWindow) -> None:
        """Other plots in the place of those that there are, for other curves."""
        for plot in self._plots:
            plot.remove()
        self._plots = []
        series = self._series()
        with self._folder:
            for k, name in enumerate(OUTPUTS):
                data = self._columns(curves, name)
                plot = self._server.gui.add_uplot(
                    data,
                    series,
                    title=f"{name} [{_AXES[name].unit}]",
                    scales=_scales_of(data, name),
                    legend=uplot.Legend(show=k == 0, live=False),
                    height=150 if k else 180,
                )
                self._plots.append(plot)

    def _series(self) -> tuple[uplot.Series, ...]:
        if self._choice.value == _ALL:
            curves = [
                uplot.Series(label=name, stroke=robot_colour(i), width=1.5)
                for i, name in enumerate(self._shape.robots)
            ]
        else:
            curves = [
                uplot.Series(label=kind, stroke=LINES[style]["color"], width=1.5)
                for kind, style in _STYLES.items()
            ]
        return uplot.Series(label="s"), *curves, _ASKED


def _scales_of(data: Sequence[Array], name: str) -> dict[str, uplot.Scale]:
    """Axes that leave out what is not known, which the browser would take for numbers."""
    ends = axis_range(data[1:], _AXES[name].step)
    return {"x": uplot.Scale(time=False), "y": uplot.Scale(range=ends)}
