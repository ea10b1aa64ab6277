"""Figures of the trunks' outputs: asked for, planned, estimated and true; and of the yokes."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.figure import Figure

from quadriga.charts.colours import robot_style, truth_style, yoke_style
from quadriga.charts.draw import Legend, draw_panels
from quadriga.charts.panels import BESIDE, Curve, Mark, Panel, PanelGrid
from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.recordings.traces import demanded_outputs, estimate_errors
from quadriga.recordings.truth import Ticks
from quadriga.report.run import ReportedRun
from quadriga.shared.codes import FALL
from quadriga.shared.robots.conventions import OUTPUTS, Array, yoke_pairs
from quadriga.shared.topics import SAMPLE_MS
from quadriga.tables import LABELS, UNITS

NAMES: Final = ("z [m]", "vx [m/s]", "vy [m/s]", "roll [rad]", "pitch [rad]", "wz [rad/s]")
_SPANS: Final = (0.04, 0.3, 0.2, 0.1, 0.1, 0.4)
_ORDER: Final = (0, 3, 1, 4, 2, 5)  # of the panels, two in a row: z roll, vx pitch, vy wz
_GAP: Final = 0.05  # s without a sample, after which a curve is not joined
_POINTS: Final = 60_000  # of all trajectories together, so that the page stays small
_LEAST: Final = 200  # points of one curve
_MOST: Final = 1000


def mark_falls(run: ReportedRun) -> list[Mark]:
    """Marks of all falls."""
    return [
        Mark(entry.tick / 1000.0, "fall", f"{entry.robot} fell")
        for entry in run.timeline
        if entry.kind == FALL
    ]


def first_fall(run: ReportedRun) -> float:
    """Time up to which values choose the range of their axes, s; infinite without a fall."""
    return min((mark.time for mark in mark_falls(run)), default=float("inf"))


def robot_legend(run: ReportedRun) -> list[tuple[str, str]]:
    """An entry for each robot."""
    return [(robot_style(index), robot) for index, robot in enumerate(run.traces.robots)]


def draw_over_run(
    run: ReportedRun,
    panels: list[Panel],
    legend: Legend,
    title: str,
    *,
    most: int = _MOST,
    height: float = 90.0,
) -> Figure:
    """Panels over the whole run, two in a row."""
    grid = PanelGrid(run.begin / 1000, run.end / 1000, columns=2, height=height, points=most)
    return draw_panels(panels, grid, marks=mark_falls(run), legend=legend, title=title)


def draw_trajectory(
    run: ReportedRun, index: int, part: tuple[float, float] | None = None
) -> Figure:
    """Every output of one robot: asked for, planned, estimated and true.

    Args:
        run: the run.
        index: the robot's place.
        part: first and last time, s; None: the whole run.
    """
    traces, robot = run.traces, run.traces.robots[index]
    own, truth = traces.measurements[robot], traces.truth
    begin, _, planned = join_applied_samples(traces.plans[robot], traces.config.planner.applied)
    reference_tick, _ = run.outputs_of(index)
    commanded = demanded_outputs(traces, reference_tick)
    panels = []
    for i in _ORDER:
        curves = []
        if run.has_truth:
            true = truth.y[:, index, i]
            curves.append(Curve(truth.tick / 1000, true, truth_style(index), gap=_GAP))
        curves.append(Curve(own.tick / 1000, own.y[:, i], "own", gap=_GAP))
        curves.append(
            Curve(begin + SAMPLE_MS / 1000, planned[:, i], "planned", gap=1.5e-3 * SAMPLE_MS)
        )
        curves.append(Curve(reference_tick / 1000, commanded[:, i], "asked"))
        span = _SPANS[i] if part is None else 0.5 * _SPANS[i]
        until = first_fall(run)
        panels.append(Panel(NAMES[i], curves, span=span, until=until, beside=BESIDE[i]))
    legend = [
        *([(truth_style(index), "measured (truth)")] if run.has_truth else []),
        ("own", "estimated by the agent"),
        ("planned", "planned"),
        ("asked", "asked for"),
    ]
    title = f"{robot}: height, speeds and angles of the trunk"
    if part is None:
        return draw_over_run(run, panels, legend, title, most=_share_points(run, 24))
    grid, title = PanelGrid(*part, columns=2), f"{title}, four strides enlarged"
    return draw_panels(panels, grid, marks=mark_falls(run), legend=legend, title=title)


def draw_reference(run: ReportedRun) -> Figure:
    """What was asked of the team, and every robot's mean over one gait period."""
    panels = []
    period = 2 * run.traces.config.gait.stance_ms
    reference_tick, _ = run.outputs_of(0)
    commanded = demanded_outputs(run.traces, reference_tick)
    for i in (1, 2, 0, 5):
        curves = []
        for index in range(len(run.traces.robots)):
            tick, y = run.outputs_of(index)
            mean = average_over_period(tick, y[:, i], period)
            curves.append(Curve(tick / 1000, mean, robot_style(index), gap=_GAP))
        curves.append(Curve(reference_tick / 1000, commanded[:, i], "asked"))
        span, until = _SPANS[i] / 2, first_fall(run)
        panels.append(Panel(NAMES[i], curves, span=span, until=until, beside=BESIDE[i]))
    legend = [*robot_legend(run), ("asked", "asked for")]
    title = "What was asked for, and each robot's mean over one gait period"
    return draw_over_run(run, panels, legend, title, most=_share_points(run, 10))


def draw_estimator_errors(run: ReportedRun) -> Figure:
    """Estimated less true outputs of all robots."""
    errors = [estimate_errors(run.traces, index) for index in range(len(run.traces.robots))]
    panels = []
    for i in _ORDER:
        if OUTPUTS[i] == "z" and run.traces.config.world.uneven:
            continue  # these are heights over two different things
        factor = UNITS[OUTPUTS[i]][1]  # they are small
        curves = [
            Curve(tick / 1000, factor * error[:, i], robot_style(index), gap=_GAP)
            for index, (tick, error) in enumerate(errors)
        ]
        turned = BESIDE[i]
        beside = None if turned is None else (turned[0] / factor, turned[1])
        span, until = 0.02 * factor * _SPANS[i], first_fall(run)
        panels.append(Panel(LABELS[i], curves, span=span, until=until, beside=beside))
    most, title = _share_points(run, 12), "Estimated less true"
    return draw_over_run(run, panels, robot_legend(run), title, most=most, height=70.0)


def draw_yokes(run: ReportedRun) -> Figure:
    """Stretch and force of every yoke."""
    truth, team, robots = run.traces.truth, run.traces.config.team, run.traces.robots
    panels = []
    for title, values, span in (
        ("stretch of the yokes [mm]", 1e3 * truth.yoke_error, 0.2),
        ("force in the yokes [N], positive pushes apart", truth.yoke_force, 10.0),
    ):
        curves = [
            Curve(truth.tick / 1000, values[:, k], yoke_style(k), gap=_GAP)
            for k in range(values.shape[1])
        ]
        panels.append(Panel(title, curves, span=span, until=first_fall(run)))
    legend = [
        (yoke_style(k), f"{robots[i]}–{robots[j]}")
        for k, (i, j) in enumerate(yoke_pairs(team.robots, team.yokes))
    ]
    most, title = _share_points(run, 4), "Stretch of the yokes, and the forces in them"
    return draw_over_run(run, panels, legend, title, most=most, height=120.0)


def average_over_period(tick: Ticks, values: Array, period_ms: int) -> Array:
    """Mean over the `period_ms` around each sample, over what there is of it. Shape as `values`."""
    if not len(tick):
        return values
    sums = np.concatenate([[0.0], np.cumsum(values)])
    first = np.minimum(np.searchsorted(tick, tick - period_ms // 2), len(tick) - 1)
    last = np.maximum(np.searchsorted(tick, tick + period_ms // 2), first + 1)
    mean: Array = (sums[last] - sums[first]) / (last - first)
    return mean


def _share_points(run: ReportedRun, curves: int) -> int:
    """Points that each of so many curves of each robot may have."""
    return min(_MOST, max(_LEAST, _POINTS // max(1, curves * len(run.traces.robots))))
