"""Figures of the processes: what happened when, solve and tick times, ages of inputs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from quadriga.agents.gait import step_ms
from quadriga.agents.planning.active_plan import FADED
from quadriga.charts.colours import BARS, broad_style, robot_style
from quadriga.charts.draw import draw_panels
from quadriga.charts.panels import Bars, Curve, Mark, Panel, PanelGrid
from quadriga.recordings.traces import plan_times, quantile_of, times_of
from quadriga.report.run import ReportedRun
from quadriga.report.trunk_figures import draw_over_run, mark_falls, robot_legend
from quadriga.shared.members import PLANNER
from quadriga.shared.messages import Status
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import REFERENCE
from quadriga.tables import format_number

_BINS: Final = 60  # of a histogram
_SENT_S: Final = 0.3  # statuses further apart than this are not joined
_WORLD: Final = ("push", "fall", "fault", "stop", "terrain", "payload")
_LEGEND: Final = (
    ("mode-walk", "walk"), ("mode-stand", "stand"), ("mode-stopping", "stopping; plan faded"),
    ("mode-damping", "damping, e-stop; messages missing"), ("nominal", "other plan status"),
    ("count", "counted by the agent"),
)  # fmt: skip


def draw_timeline(run: ReportedRun) -> Figure:
    """Modes, plans and gaps of every robot, and the events of the world."""
    last = run.end / 1000
    world = [
        (entry.tick / 1000, entry.tick / 1000, "trouble" if entry.trouble else "event")
        for entry in run.timeline
        if entry.kind in _WORLD and entry.tick > run.begin
    ]
    panels = [Panel("events of the world", rows=[Bars("", world)])] if world else []
    for robot in run.traces.robots:
        mine = [entry for entry in run.timeline if entry.robot == robot]
        plans = [
            (e.tick / 1000, e.stop / 1000, "faded" if e.code == FADED else "nominal")
            for e in mine
            if e.kind == "plan"
        ]
        other = [
            (e.tick / 1000, e.stop / 1000, "gap" if e.kind == "gap" else "count")
            for e in mine
            if e.kind in ("gap", "counted")
        ]
        modes = list(_build_mode_bars(run.traces.statuses[robot], last))
        panels.append(
            Panel(robot, rows=[Bars("mode", modes), Bars("plan", plans), Bars("other", other)])
        )
    stops = [Mark(e.tick / 1000, "stopped", "") for e in run.timeline if e.kind == "stopped"]
    grid = PanelGrid(run.begin / 1000, last)
    marks, title = [*stops, *mark_falls(run)], "Modes, plans and what went missing"
    return draw_panels(panels, grid, marks=marks, legend=_LEGEND, title=title)


def _build_mode_bars(
    statuses: tuple[Status, ...], last: float
) -> Iterator[tuple[float, float, str]]:
    begin = 0
    for k, status in enumerate(statuses):
        following = statuses[k + 1] if k + 1 < len(statuses) else None
        if following is not None and following.mode == status.mode:
            continue
        stop = following.tick / 1000 if following else last
        name = f"mode-{status.mode}"
        yield statuses[begin].tick / 1000, stop, name if name in BARS else "mode-other"
        begin = k + 1


def draw_times(run: ReportedRun) -> Figure:
    """The longest planner and tick time between two statuses, every robot."""
    planner, tick = [], []
    for index, name in enumerate((*run.traces.robots, PLANNER)):
        statuses = run.traces.statuses[name]
        style = robot_style(index) if name != PLANNER else "asked"
        planner.append(_build_worst(statuses, [s.planner_ms for s in statuses], style))
        tick.append(_build_worst(statuses, [s.tick_us for s in statuses], style))
    kilohertz = [(1000.0, "1 kHz")]
    panels = [
        Panel("longest planner solve in 100 ms [ms]", planner, log=True, span=1.0),
        Panel("longest control tick in 100 ms [µs]", tick, log=True, span=1.0, levels=kilohertz),
    ]
    legend = robot_legend(run)
    if find_kind(run.traces.config.planner.kind).central:
        legend.append(("asked", PLANNER))
    title = "Planner solves and control ticks, by the wall clock"
    return draw_over_run(run, panels, legend, title, height=130.0)


def _build_worst(statuses: tuple[Status, ...], values: list[Array], style: str) -> Curve:
    points = [(s.tick / 1000, v.max()) for s, v in zip(statuses, values, strict=True) if len(v)]
    time, worst = np.array(points).reshape(-1, 2).T
    return Curve(time, worst, style, gap=_SENT_S)


def list_times(run: ReportedRun) -> list[tuple[str, ...]]:
    """A row for each process: how many there were, medians, 99 % quantiles, maxima.

    The first planner solve of each process is counted, but in no other figure.
    """
    rows = []
    for name, statuses in run.traces.statuses.items():
        if not statuses:
            continue
        cells = [name]
        for field, digits in (("planner_ms", ".2f"), ("tick_us", ".0f")):
            values = _read_times(statuses, field)
            cells.append(f"{len(times_of(statuses, field)):,}")
            cells += [format_number(quantile_of(values, q), digits) for q in (0.5, 0.99, 1.0)]
        rows.append(tuple(cells))
    return rows


def _read_times(statuses: Sequence[Status], field: str) -> Array:
    """Times of planner solves, but for the first of each process, or of control ticks."""
    return plan_times(statuses) if field == "planner_ms" else times_of(statuses, field)


def draw_ages(run: ReportedRun) -> Figure:
    """Age of the reference and of every peer's plan that a plan was made with."""
    traces, step = run.traces, step_ms(run.traces.config)
    panels = []
    for robot in traces.robots:
        curves: list[Curve] = []
        for index, peer in enumerate(traces.robots):
            used = [
                (plan.tick, step * (plan.step - plan.used[peer]))
                for plan in traces.plans[robot]
                if peer in plan.used
            ]
            if used:
                time, age = np.array(used, dtype=float).T
                # Ages are often equal: every other curve is broad, so that none hides another.
                style = (broad_style if len(curves) % 2 == 0 else robot_style)(index)
                curves.append(Curve(time / 1000, age, style, "step", gap=2.1e-3 * step))
        for name, style in (("reference", "asked"), ("plan", "planned")):
            ages = [(s.tick, s.ages_ms[name]) for s in traces.statuses[robot] if name in s.ages_ms]
            if ages:
                time, age = np.array(ages, dtype=float).T
                curves.append(Curve(time / 1000, age, style, "step", gap=_SENT_S))
        levels = [(float(REFERENCE.max_age_ms), "reference: stops")]
        title = f"{robot}: age of what it goes by [ms]"
        panels.append(Panel(title, curves, span=100.0, floor=0.0, levels=levels))
    central = find_kind(traces.config.planner.kind).central
    legend = [("planned", "central plan")] if central else robot_legend(run)
    title = "Ages of plans and of the reference, by world time"
    return draw_over_run(run, panels, [*legend, ("asked", "reference")], title, height=70.0)


def draw_time_histograms(run: ReportedRun) -> Figure:
    """Distribution of planner solve times and control tick times of every robot.

    Of planner solves the first of each process is left out.
    """
    panels = []
    for field, what, unit in (
        ("planner_ms", "planner solve", "ms"),
        ("tick_us", "control tick", "µs"),
    ):
        title, across = f"number of {what}s", f"time of a {what} [{unit}]"
        times = [_read_times(run.traces.statuses[robot], field) for robot in run.traces.robots]
        every = np.concatenate(times)
        if not len(every):
            panels.append(Panel(f"{title}: none recorded", span=1.0, across=across))
            continue
        # Beyond the 99.5 % quantile lie single outliers that would flatten the rest.
        edges = np.linspace(0.0, 1.1 * float(np.quantile(every, 0.995)) + 1e-9, _BINS + 1)
        curves: list[Curve] = []
        for index, values in enumerate(times):
            counts, _ = np.histogram(np.minimum(values, edges[-1]), edges)
            style, held = robot_style(index), 1.4 * float(edges[1])  # the last bin is drawn too
            curves.append(Curve(edges[:-1], counts.astype(float), style, "step", gap=held))
        part = (0.0, float(edges[-1]))
        panels.append(Panel(title, curves, floor=0.0, part=part, across=across))
    grid = PanelGrid(0.0, 1.0, columns=2, height=200.0)
    title = "How long planner solves and control ticks took, by the wall clock"
    return draw_panels(panels, grid, legend=robot_legend(run), title=title)
