"""Curves for Rerun: outputs, forces, times and ages of each robot; modes, and events in words."""

from __future__ import annotations

from collections import defaultdict
from typing import Any, Final

import numpy as np
import rerun as rr

from quadriga.charts.colours import PALETTE
from quadriga.export.rerun_log import RerunLog
from quadriga.export.source import WARNINGS
from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.recordings.traces import Traces, demanded_outputs
from quadriga.recordings.truth import Ticks
from quadriga.shared.messages import Status
from quadriga.shared.robots.colours import robot_colour, to_rgb
from quadriga.shared.robots.conventions import OUTPUTS, Array, Leg
from quadriga.shared.topics import SAMPLE_MS

EVENTS: Final = "/events"
FACTORS: Final = np.array([1.0, 1.0, 1.0, *np.rad2deg([1.0, 1.0, 1.0])])  # of OUTPUTS
TITLES: Final = ("z [m]", "vx [m/s]", "vy [m/s]", "roll [°]", "pitch [°]", "wz [°/s]")
_GREY: Final = "#8c8c8c"  # seen on dark ground and on bright
_WIDE, _THIN = 2.5, 1.0  # pixels


def log_curves(log: RerunLog, traces: Traces) -> None:
    """Log everything that is plotted or read."""
    for index, robot in enumerate(traces.robots):
        _log_outputs(log, traces, index)
        _log_forces(log, traces, index)
        _log_statuses(log, traces.statuses[robot], f"/{robot}", robot_colour(index))
    _log_events(log, traces)


def _log_outputs(log: RerunLog, traces: Traces, index: int) -> None:
    """Height, speeds and angles: true, estimated, planned and asked for."""
    robot, truth = traces.robots[index], traces.truth
    own = traces.measurements[robot]
    ticks, _, planned = _applied(traces, robot)
    asked = truth.tick if len(truth.tick) else own.tick
    curves: tuple[tuple[str, Ticks, Array, str, float], ...] = (
        ("true", truth.tick, truth.y[:, index], robot_colour(index), _WIDE),
        ("estimated", own.tick, own.y, _GREY, _THIN),
        ("planned", ticks + SAMPLE_MS, planned, PALETTE["purple"], _THIN),
        ("asked", asked, demanded_outputs(traces, asked), PALETTE["yellow"], _THIN),
    )
    for name, tick, values, colour, width in curves:
        for k, output in enumerate(OUTPUTS if len(tick) else ()):
            path = f"/{robot}/{output}/{name}"
            _keep_line(
                log, path, "asked for" if name == "asked" else f"{robot} {name}", colour, width
            )
            log.scalar(path, tick, FACTORS[k] * values[:, k])


def _log_forces(log: RerunLog, traces: Traces, index: int) -> None:
    """Vertical forces of the feet: true and planned."""
    robot, truth = traces.robots[index], traces.truth
    ticks, forces, _ = _applied(traces, robot)
    for leg in Leg:
        path = f"/{robot}/force/{leg.name}"
        if len(truth.tick):
            _keep_line(log, f"{path}/true", f"{leg.name} true", robot_colour(index), _WIDE)
            log.scalar(f"{path}/true", truth.tick, truth.grf[:, index, leg, 2])
        if len(ticks):
            colour = PALETTE["purple"]
            _keep_line(log, f"{path}/planned", f"{leg.name} planned", colour, _THIN)
            log.scalar(f"{path}/planned", ticks, forces[:, 3 * leg + 2])


def _applied(traces: Traces, robot: str) -> tuple[Ticks, Array, Array]:
    """Ticks at which applied samples begin, their forces and outputs, in order of time."""
    begin, forces, y = join_applied_samples(traces.plans[robot], traces.config.planner.applied)
    ticks = np.rint(1000.0 * begin).astype(np.int64)
    order = np.argsort(ticks, kind="stable")
    return ticks[order], forces[order], y[order]


def _log_statuses(log: RerunLog, statuses: tuple[Status, ...], path: str, colour: str) -> None:
    """Modes, the longest times between two statuses, and ages of inputs."""
    if not statuses:
        return
    ticks = np.array([status.tick for status in statuses], dtype=np.int64)
    named = [f"{s.mode}: {s.reason}" if s.reason else s.mode for s in statuses]
    changed = [k for k, name in enumerate(named) if k == 0 or name != named[k - 1]]
    states = rr.StateChange.columns(state=[named[k] for k in changed])
    log.over_time(f"{path}/mode", ticks[changed], states)
    for field, name in (("planner_ms", "planner [ms]"), ("tick_us", "control tick [µs]")):
        every = [getattr(status, field) for status in statuses]
        timed = [k for k, values in enumerate(every) if len(values)]
        _keep_line(log, f"{path}/times/{field}", name, colour, _WIDE)
        log.scalar(f"{path}/times/{field}", ticks[timed], [every[k].max() for k in timed])
    ages: defaultdict[str, list[tuple[int, float]]] = defaultdict(list)
    for status in statuses:
        for name, age in status.ages_ms.items():
            ages[name].append((status.tick, age))
    for name, rows in ages.items():
        log.scalar(
            f"{path}/ages/{rr.escape_entity_path_part(name)}",
            np.array([tick for tick, _ in rows], dtype=np.int64),
            [age for _, age in rows],
        )


def _log_events(log: RerunLog, traces: Traces) -> None:
    """What happened, in words."""
    events = traces.events
    colours: dict[str, Any] = {
        robot: to_rgb(robot_colour(index)) for index, robot in enumerate(traces.robots)
    }
    columns = rr.TextLog.columns(
        text=[f"{event.robot or 'world'} {event.kind}: {event.detail}" for event in events],
        level=["WARN" if event.kind in WARNINGS else "INFO" for event in events],
        color=[colours.get(event.robot, to_rgb(_GREY)) for event in events],
    )
    log.over_time(EVENTS, np.array([event.tick for event in events], dtype=np.int64), columns)


def _keep_line(log: RerunLog, path: str, name: str, colour: str, width: float) -> None:
    lines = rr.SeriesLines(names=[name], colors=[to_rgb(colour)], widths=[width])
    log.keep(path, lines)
