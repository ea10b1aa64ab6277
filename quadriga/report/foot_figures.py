"""Figures of the feet: planned and true forces, and the gait."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from quadriga.charts.colours import contact_style, truth_style
from quadriga.charts.draw import draw_panels
from quadriga.charts.panels import Bars, Curve, Panel, PanelGrid
from quadriga.charts.thinning import find_spells
from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.recordings.truth import Ticks
from quadriga.report.run import ReportedRun
from quadriga.report.trunk_figures import first_fall, mark_falls
from quadriga.shared.robots.conventions import Leg
from quadriga.shared.topics import SAMPLE_MS

_GAP: Final = 1.5e-3 * SAMPLE_MS
_STRIDES: Final = 4  # enlarged
_STRONG: Final = 200.0  # N, three times what a foot carries: impacts beyond are cut off
_SHOWN: Final = 10.0  # s of gait; more cannot be told apart


def draw_forces(run: ReportedRun) -> Figure:
    """Vertical force of every robot's front-right foot, as the paper's Fig. 3."""
    panels = [
        _build_force_panel(run, i, Leg.FR, f"{robot} front right [N]")
        for i, robot in enumerate(run.traces.robots)
    ]
    grid = PanelGrid(run.begin / 1000, run.end / 1000, height=80.0, points=1200)
    title = "Vertical forces of the front right feet"
    return draw_panels(panels, grid, marks=mark_falls(run), legend=_force_legend(run), title=title)


def draw_forces_enlarged(run: ReportedRun) -> Figure:
    """Vertical forces of all feet in four strides."""
    panels = [
        _build_force_panel(run, i, leg, f"{robot} {leg.name} [N]")
        for i, robot in enumerate(run.traces.robots)
        for leg in Leg
    ]
    grid = PanelGrid(*four_strides(run), columns=len(Leg), height=70.0)
    title = "Vertical forces of all feet in four strides"
    return draw_panels(panels, grid, marks=mark_falls(run), legend=_force_legend(run), title=title)


def draw_forces_of_first(run: ReportedRun) -> Figure:
    """Vertical force of the first robot's front-right foot: the whole run, and four strides."""
    robot = run.traces.robots[0]
    panel = _build_force_panel(run, 0, Leg.FR, f"{robot} front right [N]")
    part = replace(panel, title="four strides, enlarged", part=four_strides(run))
    grid = PanelGrid(run.begin / 1000, run.end / 1000, columns=2, height=200.0)
    title = f"{robot}: vertical force of the front right foot"
    legend = _force_legend(run)
    return draw_panels([panel, part], grid, marks=mark_falls(run), legend=legend, title=title)


def draw_gait(run: ReportedRun) -> tuple[Figure, float, float]:
    """Scheduled stance and contact of every foot, and from when to when, s."""
    end = min(run.end / 1000, first_fall(run) + 0.5)
    begin = max(run.begin / 1000, end - _SHOWN)
    panels = [build_gait_panel(run, index) for index in range(len(run.traces.robots))]
    grid = PanelGrid(begin, end)
    title, legend = "Gait: which feet were to stand, and which touched the ground", gait_legend(run)
    figure = draw_panels(panels, grid, marks=mark_falls(run), legend=legend, title=title)
    return figure, begin, end


def build_gait_panel(run: ReportedRun, index: int) -> Panel:
    """One robot's feet: bars of scheduled stance, and in them thin ones of contact."""
    robot = run.traces.robots[index]
    samples = run.samples[robot]
    rows = [
        Bars(
            leg.name,
            [
                *_build_bars(samples.tick, samples.stance[:, leg], "stance", shift=-SAMPLE_MS),
                *_build_bars(samples.tick, samples.contact[:, leg], contact_style(index)),
            ],
        )
        for leg in Leg
    ]
    return Panel(robot, rows=rows)


def gait_legend(run: ReportedRun) -> list[tuple[str, str]]:
    """What the bars of the gait mean."""
    contact = "true contact" if run.has_truth else "contact by the foot sensor"
    return [("stance", "scheduled stance"), ("contact", f"{contact}, in the robot's colour")]


def four_strides(run: ReportedRun) -> tuple[float, float]:
    """First and last time, s, of four strides before the first fall, in the middle of the run."""
    seconds = 2e-3 * run.traces.config.gait.stance_ms * _STRIDES
    end = min(run.end / 1000, first_fall(run))
    middle = 0.5 * (run.begin / 1000 + end)
    begin = max(run.begin / 1000, middle - seconds / 2)
    return begin, min(begin + seconds, run.end / 1000)


def _force_legend(run: ReportedRun) -> list[tuple[str, str]]:
    unit = "N" if run.traces.config.feet_measure_newtons else "counts"
    source = "ground reaction (truth)" if run.has_truth else f"by the foot sensor, {unit}"
    return [("true", f"{source}, in the robot's colour"), ("planned", "planned, as applied")]


def _build_force_panel(run: ReportedRun, index: int, leg: Leg, title: str) -> Panel:
    traces, robot = run.traces, run.traces.robots[index]
    begin, forces, _ = join_applied_samples(traces.plans[robot], traces.config.planner.applied)
    style = truth_style(index)
    if run.has_truth:
        true = Curve(traces.truth.tick / 1000, traces.truth.grf[:, index, leg, 2], style, gap=0.05)
    else:
        samples = run.samples[robot]
        true = Curve(samples.tick / 1000, samples.foot_force[:, leg], style, gap=0.05)
    plan = Curve(begin, forces[:, 3 * leg + 2], "planned", "step", gap=_GAP)
    return Panel(title, [true, plan], span=80.0, floor=0.0, ceiling=_STRONG)


def _build_bars(
    tick: Ticks, mask: Any, style: str, shift: int = 0
) -> list[tuple[float, float, str]]:
    """Runs of True as bars; a sample of scheduled stance is about the 10 ms before it."""
    jumps = np.flatnonzero(np.diff(tick, prepend=tick[:1]) > 5 * SAMPLE_MS)
    bars = []
    for a, b in find_spells(mask):
        cuts = [a, *(int(k) for k in jumps if a < k < b), b]
        for first, last in pairwise(cuts):
            begin, stop = int(tick[first]) + shift, int(tick[last - 1]) + SAMPLE_MS + shift
            bars.append((begin / 1000, stop / 1000, style))
    return bars
