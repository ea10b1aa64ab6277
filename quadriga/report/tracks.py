"""Figures of the trunks: planned, measured and asked for; errors; paths from above."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.pictures.figures import stitched
from quadriga.recordings.traces import estimate_errors, in_force
from quadriga.recordings.truth import Ticks
from quadriga.report.axis import nice
from quadriga.report.chart import WIDTH, draw
from quadriga.report.panel import Curve, Mark, Panel
from quadriga.report.run import Run
from quadriga.shared.config.yokes import yoke_pairs
from quadriga.shared.robot.a1 import OUTPUTS, Array
from quadriga.shared.wire.topics import SAMPLE_MS

NAMES: Final = ("z [m]", "vx [m/s]", "vy [m/s]", "roll [rad]", "pitch [rad]", "wz [rad/s]")
_SPANS: Final = (0.04, 0.3, 0.2, 0.1, 0.1, 0.4)
_ORDER: Final = (0, 3, 1, 4, 2, 5)  # of the panels, two in a row: z roll, vx pitch, vy wz
_GAP: Final = 0.05  # s without a sample, after which a curve is not joined
_POINTS: Final = 60_000  # of all trajectories together, so that the page stays small
_LEAST: Final = 200  # points of one curve
_MOST: Final = 1000
_INSTANTS: Final = 6


def style(index: int) -> str:
    """The class of a robot's curves."""
    return f"r{index % 10}"


def falls(run: Run) -> list[Mark]:
    """Marks of all falls."""
    return [
        Mark(moment.tick / 1000.0, "fall", f"{moment.robot} fell")
        for moment in run.moments
        if moment.kind == "fall"
    ]


def until(run: Run) -> float:
    """Time up to which values choose the range of their axes: the first fall, s."""
    return min((mark.time for mark in falls(run)), default=float("inf"))


def points(run: Run, curves: int) -> int:
    """Points that each of the curves of the trajectories may have."""
    return min(_MOST, max(_LEAST, _POINTS // max(1, curves * len(run.traces.robots))))


def figure(
    run: Run, panels: list[Panel], name: str, *, most: int = _MOST, height: float = 90.0
) -> str:
    """Panels over the whole run, two in a row."""
    return draw(
        panels,
        run.begin / 1000,
        run.end / 1000,
        marks=falls(run),
        columns=2,
        height=height,
        points=most,
        name=name,
    )


def trajectories(run: Run, index: int, part: tuple[float, float] | None = None) -> str:
    """Every output of one robot: asked for, planned, estimated and true.

    Args:
        run: the run.
        index: the robot's place.
        part: first and last time, s; None: the whole run.
    """
    traces, robot = run.traces, run.traces.robots[index]
    own, truth = traces.measurements[robot], traces.truth
    begin, _, planned = stitched(traces.plans[robot], traces.config.planner.applied)
    asked, wanted = _wanted(run, index)
    panels = []
    for i in _ORDER:
        curves = []
        if run.has_truth:
            curves.append(Curve(truth.tick / 1000, truth.y[:, index, i], "true", gap=_GAP))
        curves.append(Curve(own.tick / 1000, own.y[:, i], "own", gap=_GAP))
        curves.append(
            Curve(begin + SAMPLE_MS / 1000, planned[:, i], "planned", gap=1.5e-3 * SAMPLE_MS)
        )
        curves.append(Curve(asked / 1000, wanted[:, i], "asked"))
        span = _SPANS[i] if part is None else 0.5 * _SPANS[i]
        panels.append(Panel(NAMES[i], curves, span=span, until=until(run)))
    if part is not None:
        return draw(panels, *part, marks=falls(run), columns=2, name=f"part of {robot}'s")
    return figure(run, panels, f"trajectories of {robot}", most=points(run, 24))


def reference_against_measured(run: Run) -> str:
    """What was asked of the team, and every robot's mean over one gait period."""
    panels = []
    period = 2 * run.traces.config.gait.stance_ms
    for i in (1, 2, 0, 5):
        curves = []
        for index in range(len(run.traces.robots)):
            tick, y = run.measured(index)
            curves.append(
                Curve(tick / 1000, moving_mean(tick, y[:, i], period), style(index), gap=_GAP)
            )
        asked, wanted = _wanted(run, 0)
        curves.append(Curve(asked / 1000, wanted[:, i], "asked"))
        panels.append(Panel(NAMES[i], curves, span=_SPANS[i] / 2, until=until(run)))
    return figure(run, panels, "reference against measured", most=points(run, 10))


def estimator_errors(run: Run) -> str:
    """Estimated less true outputs of all robots."""
    robots, panels = range(len(run.traces.robots)), []
    errors = [estimate_errors(run.traces, index) for index in robots]
    for i in _ORDER:
        if OUTPUTS[i] == "z" and run.traces.config.world.uneven:
            continue  # these are heights over two different things
        curves = []
        for index in robots:
            tick, error = errors[index]
            curves.append(Curve(tick / 1000, error[:, i], style(index), gap=_GAP))
        panels.append(Panel(NAMES[i], curves, span=0.02 * _SPANS[i], until=until(run)))
    return figure(run, panels, "estimator errors", most=points(run, 12), height=70.0)


def yokes(run: Run) -> str:
    """Stretch and force of every yoke."""
    truth = run.traces.truth
    time, most = truth.tick / 1000, points(run, 4)
    panels = []
    for title, values, span in (
        ("stretch of the yokes [mm]", 1e3 * truth.yoke_error, 0.2),
        ("force in the yokes [N], positive pushes apart", truth.yoke_force, 10.0),
    ):
        curves = [Curve(time, values[:, k], style(k), gap=_GAP) for k in range(values.shape[1])]
        panels.append(Panel(title, curves, span=span, until=until(run)))
    return figure(run, panels, "yokes", most=most, height=120.0)


def yoke_names(run: Run) -> list[str]:
    """Names of the yokes in the order of their curves."""
    team, robots = run.traces.config.team, run.traces.robots
    return [f"{robots[i]}–{robots[j]}" for i, j in yoke_pairs(team.robots, team.yokes)]


def top_view(run: Run) -> str:
    """The trunks' ways from above, and the yokes at some instants."""
    pos, tick = run.traces.truth.base_pos[..., :2], run.traces.truth.tick
    low, high = pos.min(axis=(0, 1)) - 0.3, pos.max(axis=(0, 1)) + 0.3
    scale = min((WIDTH - 70.0) / (high[0] - low[0]), 420.0 / (high[1] - low[1]))
    tall = scale * float(high[1] - low[1])
    x, y = 58.0 + scale * (pos[..., 0] - low[0]), 10.0 + scale * (high[1] - pos[..., 1])
    parts = []
    for value in nice(float(low[0]), float(high[0]), 8):
        at = 58.0 + scale * (value - float(low[0]))
        parts.append(f'<path class="grid" d="M{at:.1f} 10v{tall:.1f}"/>')
        parts.append(f'<text class="tick mid" x="{at:.1f}" y="{tall + 26:.0f}">{value:g}</text>')
    for value in nice(float(low[1]), float(high[1]), max(2, int(tall // 60))):
        at = 10.0 + scale * (float(high[1]) - value)
        parts.append(f'<path class="grid" d="M58 {at:.1f}h{scale * float(high[0] - low[0]):.1f}"/>')
        parts.append(f'<text class="tick end" x="52" y="{at + 4:.1f}">{value:g}</text>')
    team = run.traces.config.team
    shown = np.unique(np.linspace(0, len(tick) - 1, _INSTANTS).astype(int))
    for k in shown:
        for i, j in yoke_pairs(team.robots, team.yokes):
            parts.append(
                f'<path class="yoke" d="M{x[k, i]:.1f} {y[k, i]:.1f}L{x[k, j]:.1f} {y[k, j]:.1f}"/>'
            )
    for i in range(len(run.traces.robots)):
        way = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x[::5, i], y[::5, i], strict=True))
        parts.append(f'<path class="curve way {style(i)}" d="M{way}"/>')
        for k in shown:
            parts.append(
                f'<circle class="{style(i)}" cx="{x[k, i]:.1f}" cy="{y[k, i]:.1f}" r="4"/>'
            )
    labelled = (-1e3, -1e3)
    for k in shown:
        top = int(np.argmin(y[k]))
        spot = (float(x[k, top]), float(y[k, top]))
        if abs(spot[0] - labelled[0]) < 36.0 and abs(spot[1] - labelled[1]) < 14.0:
            continue  # it would cover the one before
        labelled = spot
        parts.append(
            f'<text class="tick mid" x="{x[k, top]:.1f}" y="{y[k, top] - 9:.1f}">'
            f"{tick[k] / 1000:.1f} s</text>"
        )
    middle = 58.0 + 0.5 * scale * float(high[0] - low[0])
    parts.append(
        f'<text class="tick mid" x="{middle:.0f}" y="{tall + 44:.0f}">x [m], y [m] upwards</text>'
    )
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {tall + 50:.0f}" role="img" aria-label="paths from above">'
        f"{''.join(parts)}</svg>"
    )


def moving_mean(tick: Ticks, values: Array, period_ms: int) -> Array:
    """Mean over the `period_ms` around each sample, over what there is of it. Shape as `values`."""
    if not len(tick):
        return values
    sums = np.concatenate([[0.0], np.cumsum(values)])
    first = np.minimum(np.searchsorted(tick, tick - period_ms // 2), len(tick) - 1)
    last = np.maximum(np.searchsorted(tick, tick + period_ms // 2), first + 1)
    mean: Array = (sums[last] - sums[first]) / (last - first)
    return mean


def _wanted(run: Run, index: int) -> tuple[Ticks, Array]:
    """Ticks and the outputs asked for then; shape (·, 6), NaN before the first reference."""
    tick, _ = run.measured(index)
    reference = in_force(run.traces.references, tick)
    wanted = np.zeros((len(tick), len(OUTPUTS)))
    wanted[:, [1, 2, 5, 0]] = reference
    wanted[np.isnan(reference).any(axis=1)] = np.nan
    return tick, wanted
