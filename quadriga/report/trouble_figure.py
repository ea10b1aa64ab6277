"""The figure of the second before a trouble."""

from __future__ import annotations

from typing import Final

from matplotlib.figure import Figure

from quadriga.charts.colours import robot_style
from quadriga.charts.draw import draw_panels
from quadriga.charts.panels import DEGREES, Curve, Mark, Panel, PanelGrid
from quadriga.report.foot_figures import build_gait_panel, gait_legend
from quadriga.report.run import ReportedRun
from quadriga.report.samples import find_slip
from quadriga.report.timeline import FAULT, STOP
from quadriga.report.troubles import Trouble
from quadriga.report.trunk_figures import robot_legend
from quadriga.report.window import BEFORE_MS, SLIP, TILT
from quadriga.shared.codes import FALL

_AFTER_MS: Final = 200  # shown after the second that is judged
_GAP: Final = 0.05  # s without a sample, after which a curve is not joined
_ROBOTS: Final = 3  # whose feet are shown


def draw_trouble(run: ReportedRun, trouble: Trouble) -> Figure:
    """Tilt, slip and torque of all robots, and the feet of those concerned."""
    tilt, slip, torque = [], [], []
    for index, robot in enumerate(run.traces.robots):
        samples, style = run.samples[robot], robot_style(index)
        time = samples.tick / 1000
        tilt.append(Curve(time, samples.tilt, style, gap=_GAP))
        slip.append(Curve(time, find_slip(samples).max(axis=1), style, gap=_GAP))
        torque.append(Curve(time, 100 * samples.torque, style, gap=_GAP))
    falling = [(TILT, "unusual"), (run.traces.config.controller.fall_tilt, "fall")]
    panels = [
        Panel("tilt [rad]", tilt, span=0.3, floor=0.0, levels=falling, beside=DEGREES),
        Panel(
            "fastest foot in stance and contact [m/s]", slip, span=0.4, floor=0.0,
            levels=[(SLIP, "slips")],
        ),
        Panel("greatest joint torque [% of its limit]", torque, span=100.0, floor=0.0),
    ]  # fmt: skip
    robots = [run.traces.robots.index(r) for r in trouble.robots if r in run.traces.robots]
    panels += [build_gait_panel(run, index) for index in robots[:_ROBOTS]]
    begin = max(run.begin, trouble.tick - BEFORE_MS) / 1000
    end = min(run.end, trouble.tick + _AFTER_MS) / 1000
    legend = [*robot_legend(run), *gait_legend(run)]
    return draw_panels(
        panels,
        PanelGrid(begin, end, height=75.0),
        marks=_build_marks(run),
        legend=legend,
        title=f"The second before {trouble.tick / 1000:.2f} s",
    )


def _build_marks(run: ReportedRun) -> list[Mark]:
    fallen = {entry.robot for entry in run.timeline if entry.kind == FALL}
    return [
        Mark(e.tick / 1000, "fall" if e.kind == FALL else "stopped", f"{e.robot} {e.kind}")
        for e in run.timeline
        if e.kind in (FALL, FAULT, "push") or (e.kind == STOP and e.robot not in fallen)
    ]
