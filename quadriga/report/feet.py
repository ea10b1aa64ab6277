"""Figures of the feet: planned and true forces, and the gait."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Final

import numpy as np

from quadriga.pictures.figures import stitched
from quadriga.recordings.truth import Ticks
from quadriga.report.chart import draw
from quadriga.report.panel import Bars, Curve, Panel
from quadriga.report.path import spells
from quadriga.report.run import Run
from quadriga.report.tracks import falls, until
from quadriga.shared.robot.a1 import Leg
from quadriga.shared.wire.topics import SAMPLE_MS

_GAP: Final = 1.5e-3 * SAMPLE_MS
_STRIDES: Final = 4  # enlarged
_STRONG: Final = 200.0  # N, three times what a foot carries: impacts beyond are cut off
_SHOWN: Final = 10.0  # s of gait; more cannot be told apart


def whole(run: Run) -> str:
    """Vertical force of every robot's front-right foot, as the paper's Fig. 3."""
    panels = [_panel(run, i, Leg.FR, f"{robot} front right [N]") for i, robot in _robots(run)]
    return draw(
        panels,
        run.begin / 1000,
        run.end / 1000,
        marks=falls(run),
        height=80.0,
        points=1200,
        name="vertical forces",
    )


def enlarged(run: Run) -> tuple[str, float, float]:
    """Vertical forces of all feet in four strides, and from when to when, s."""
    begin, end = strides(run)
    panels = [
        _panel(run, i, leg, f"{robot} {leg.name} [N]") for i, robot in _robots(run) for leg in Leg
    ]
    svg = draw(
        panels,
        begin,
        end,
        marks=falls(run),
        columns=4,
        height=70.0,
        name="vertical forces, four strides",
    )
    return svg, begin, end


def gait(run: Run) -> tuple[str, float, float]:
    """Scheduled stance and contact of every foot, and from when to when, s."""
    end = min(run.end / 1000, until(run) + 0.5)
    begin = max(run.begin / 1000, end - _SHOWN)
    return gait_between(run, begin, end, range(len(run.traces.robots))), begin, end


def gait_between(run: Run, begin: float, end: float, robots: Any) -> str:
    """Scheduled stance and contact of some robots from `begin` to `end`, s."""
    panels = [gait_panel(run, index) for index in robots]
    return draw(panels, begin, end, marks=falls(run), name="gait")


def gait_panel(run: Run, index: int) -> Panel:
    """One robot's feet: bars of scheduled stance, and in them thin ones of contact."""
    robot = run.traces.robots[index]
    samples = run.samples[robot]
    rows = [
        Bars(
            leg.name,
            [
                *_bars(samples.tick, samples.stance[:, leg], "stance", shift=-SAMPLE_MS),
                *_bars(samples.tick, samples.contact[:, leg], "contact"),
            ],
        )
        for leg in Leg
    ]
    return Panel(robot, rows=rows)


def _panel(run: Run, index: int, leg: Leg, title: str) -> Panel:
    traces, robot = run.traces, run.traces.robots[index]
    begin, forces, _ = stitched(traces.plans[robot], traces.config.planner.applied)
    if run.has_truth:
        true = Curve(traces.truth.tick / 1000, traces.truth.grf[:, index, leg, 2], "true", gap=0.05)
    else:
        samples = run.samples[robot]
        true = Curve(samples.tick / 1000, samples.foot_force[:, leg], "true", gap=0.05)
    plan = Curve(begin, forces[:, 3 * leg + 2], "planned", "step", gap=_GAP)
    return Panel(title, [true, plan], span=80.0, floor=0.0, ceiling=_STRONG)


def _bars(tick: Ticks, mask: Any, style: str, shift: int = 0) -> list[tuple[float, float, str]]:
    """Runs of True as bars; a sample of scheduled stance is about the 10 ms before it."""
    jumps = np.flatnonzero(np.diff(tick, prepend=tick[:1]) > 5 * SAMPLE_MS)
    found = []
    for a, b in spells(mask):
        cuts = [a, *(int(k) for k in jumps if a < k < b), b]
        for first, last in pairwise(cuts):
            begin, stop = int(tick[first]) + shift, int(tick[last - 1]) + SAMPLE_MS + shift
            found.append((begin / 1000, stop / 1000, style))
    return found


def strides(run: Run) -> tuple[float, float]:
    """Four strides in the middle of the run, or of what there is before its first fall, s."""
    seconds = 2e-3 * run.traces.config.gait.stance_ms * _STRIDES
    end = min(run.end / 1000, until(run))
    middle = 0.5 * (run.begin / 1000 + end)
    begin = max(run.begin / 1000, middle - seconds / 2)
    return begin, min(begin + seconds, run.end / 1000)


def _robots(run: Run) -> list[tuple[int, str]]:
    return list(enumerate(run.traces.robots))
