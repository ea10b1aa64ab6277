"""Figures of the machinery: what happened when, solve and tick times, ages of inputs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from quadriga.agents.time_grid import step_ms
from quadriga.report.chart import draw
from quadriga.report.feet import gait_panel
from quadriga.report.look import BARS
from quadriga.report.look_at import Trouble
from quadriga.report.panel import Bars, Curve, Mark, Panel
from quadriga.report.run import Run
from quadriga.report.samples import slipping
from quadriga.report.second import BEFORE_MS, SLIP, TILT
from quadriga.report.tracks import falls, figure, style
from quadriga.shared.bus.members import PLANNER
from quadriga.shared.robot.a1 import Array
from quadriga.shared.wire.messages import Status
from quadriga.shared.wire.topics import REFERENCE

_AFTER_MS: Final = 200  # of a close-up, shown after the second that is judged
_SENT_S: Final = 0.3  # statuses further apart than this are not joined


def timeline(run: Run) -> str:
    """Modes, plans and gaps of every robot, and the events of the world."""
    last = run.end / 1000
    world = [
        (m.tick / 1000, m.tick / 1000, "trouble" if m.trouble else "event")
        for m in run.moments
        if m.kind in ("push", "fall", "fault", "stop", "terrain", "payload") and m.tick > run.begin
    ]
    panels = [Panel("events of the world", rows=[Bars("", world)])] if world else []
    for robot in run.traces.robots:
        rows = [Bars("mode", list(_modes(run.traces.statuses[robot], last)))]
        troubled = [
            (m.tick / 1000, m.stop / 1000, "faded" if m.text.startswith("faded") else "nominal")
            for m in run.moments
            if (m.robot, m.kind) == (robot, "plan")
        ]
        rows.append(Bars("plan", troubled))
        odd = [
            (m.tick / 1000, m.stop / 1000, "gap" if m.kind == "gap" else "count")
            for m in run.moments
            if m.robot == robot and m.kind in ("gap", "counted")
        ]
        rows.append(Bars("other", odd))
        panels.append(Panel(robot, rows=rows))
    stops = [Mark(m.tick / 1000, "stopped", "") for m in run.moments if m.kind == "stopped"]
    return draw(panels, run.begin / 1000, last, marks=[*stops, *falls(run)], name="timeline")


def _modes(statuses: tuple[Status, ...], last: float) -> Iterator[tuple[float, float, str]]:
    begin = 0
    for k, status in enumerate(statuses):
        following = statuses[k + 1] if k + 1 < len(statuses) else None
        if following is not None and following.mode == status.mode:
            continue
        stop = following.tick / 1000 if following else last
        name = f"mode-{status.mode}"
        yield statuses[begin].tick / 1000, stop, name if name in BARS else "mode-other"
        begin = k + 1


def times(run: Run) -> str:
    """The longest planner and tick time between two statuses, every robot."""
    planner, tick = [], []
    for index, name in enumerate((*run.traces.robots, PLANNER)):
        statuses = run.traces.statuses[name]
        colour = style(index) if name != PLANNER else "asked"
        planner.append(_worst(statuses, [s.planner_ms for s in statuses], colour))
        tick.append(_worst(statuses, [s.tick_us for s in statuses], colour))
    panels = [
        Panel("longest planner solve in 100 ms [ms]", planner, log=True, span=1.0),
        Panel(
            "longest control tick in 100 ms [µs]",
            tick,
            log=True,
            span=1.0,
            levels=[(1000.0, "1 kHz")],
        ),
    ]
    return figure(run, panels, "solve and tick times", height=130.0)


def _worst(statuses: tuple[Status, ...], values: list[Array], colour: str) -> Curve:
    kept = [(s.tick / 1000, v.max()) for s, v in zip(statuses, values, strict=True) if len(v)]
    time, worst = np.array(kept).reshape(-1, 2).T
    return Curve(time, worst, colour, gap=_SENT_S)


def times_table(run: Run) -> list[tuple[str, ...]]:
    """A row for each process: medians, 99 % quantiles and maxima."""
    rows = []
    for name, statuses in run.traces.statuses.items():
        if not statuses:
            continue
        cells = [name]
        for field, digits in (("planner_ms", ".2f"), ("tick_us", ".0f")):
            values = np.concatenate([np.zeros(0), *(getattr(s, field) for s in statuses)])
            cells.append(f"{len(values):,}")
            for q in (0.5, 0.99, 1.0):
                cells.append(format(np.quantile(values, q), digits) if len(values) else "–")
        rows.append(tuple(cells))
    return rows


def ages(run: Run) -> str:
    """Age of the reference and of every peer's plan that a plan was made with."""
    traces, step = run.traces, step_ms(run.traces.config)
    panels = []
    for robot in traces.robots:
        curves = []
        for index, peer in enumerate(traces.robots):
            used = [
                (p.tick, step * (p.step - p.used[peer]))
                for p in traces.plans[robot]
                if peer in p.used
            ]
            if used:
                time, age = np.array(used, dtype=float).T
                curves.append(Curve(time / 1000, age, style(index), "step", gap=2.1e-3 * step))
        for name, kind in (("reference", "asked"), ("plan", "planned")):
            told = [(s.tick, s.ages_ms[name]) for s in traces.statuses[robot] if name in s.ages_ms]
            if told:
                time, age = np.array(told, dtype=float).T
                curves.append(Curve(time / 1000, age, kind, "step", gap=_SENT_S))
        levels = [(float(REFERENCE.max_age_ms), "reference: stops")]
        panels.append(Panel(f"{robot}: age [ms]", curves, span=100.0, floor=0.0, levels=levels))
    return figure(run, panels, "ages of inputs", height=70.0)


def closeup(run: Run, episode: Trouble) -> str:
    """The second before a trouble: tilt, slip and torque of all robots, feet of those concerned."""
    begin = max(run.begin, episode.tick - BEFORE_MS) / 1000
    end = min(run.end, episode.tick + _AFTER_MS) / 1000
    tilt, slip, torque = [], [], []
    for index, robot in enumerate(run.traces.robots):
        samples = run.samples[robot]
        time = samples.tick / 1000
        tilt.append(Curve(time, samples.tilt, style(index), gap=0.05))
        slip.append(Curve(time, slipping(samples), style(index), gap=0.05))
        torque.append(Curve(time, 100 * samples.torque, style(index), gap=0.05))
    fall_tilt = run.traces.config.controller.fall_tilt
    panels = [
        Panel(
            "tilt [rad]", tilt, span=0.3, floor=0.0, levels=[(TILT, "unusual"), (fall_tilt, "fall")]
        ),
        Panel(
            "fastest foot in stance and contact [m/s]",
            slip,
            span=0.4,
            floor=0.0,
            levels=[(SLIP, "slips")],
        ),
        Panel("greatest joint torque [% of its limit]", torque, span=100.0, floor=0.0),
    ]
    robots = [run.traces.robots.index(r) for r in episode.robots if r in run.traces.robots]
    panels += [gait_panel(run, index) for index in robots[:3]]
    fell = {m.robot for m in run.moments if m.kind == "fall"}
    marks = [
        Mark(m.tick / 1000, "fall" if m.kind == "fall" else "stopped", f"{m.robot} {m.kind}")
        for m in run.moments
        if m.kind in ("fall", "fault", "push") or (m.kind == "stopped" and m.robot not in fell)
    ]
    return draw(panels, begin, end, marks=marks, height=75.0, name="the second before")
