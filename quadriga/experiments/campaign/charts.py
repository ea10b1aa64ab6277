"""Figures of a campaign: success by variant, and against what was swept."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from quadriga.charts.colours import robot_style
from quadriga.charts.draw import draw_panels
from quadriga.charts.panels import Bars, Curve, Panel, PanelGrid
from quadriga.experiments.campaign.analysis import tally
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.campaign.sheets import Rows, number, order
from quadriga.report.document import Drawing

_SUCCESS = "walked to the end [%]"


def by_variant(manifest: Manifest, rows: Rows) -> Drawing:
    """For each world a bar of Wilson's interval for each variant, and a mark at the rate."""
    panels = []
    for world in _worlds(rows):
        lines = []
        for variant in manifest.variants:
            mine = [
                row
                for g, found in rows.items()
                for row in found
                if g.world == world and g.variant == variant
            ]
            found = tally(mine)
            if found.trials:
                low, high = (100 * end for end in found.success)
                rate = 100 * found.successes / found.trials
                lines.append(Bars(variant, [(low, high, "stance"), (rate, rate, "event")]))
        if lines:
            panels.append(Panel(" · ".join(world), rows=lines))
    left = 20.0 + 7.0 * max((len(name) for name in manifest.variants), default=0)
    grid = PanelGrid(0.0, 100.0, across=_SUCCESS, left=left)
    legend = [("event", "share of the walks"), ("stance", "Wilson's 95 % interval")]
    return Drawing(draw_panels(panels, grid, legend=legend), "success by variant")


def against_swept(manifest: Manifest, rows: Rows) -> Iterator[tuple[str, Drawing]]:
    """Name and figure of success against each swept key that has numbers.

    A panel for each scenario and each value of the other keys, a curve for each variant.
    """
    for k, sweep in enumerate(manifest.sweeps):
        values = sorted({number(group.swept[k]) for group in rows})
        if len(values) < 2 or math.isinf(values[-1]):
            continue
        apart = 0.006 * (values[-1] - values[0])  # so that no interval hides another
        panels = []
        for world in _worlds(rows):
            if number(world[1 + k]) != min(
                number(other[1 + k]) for other in _worlds(rows) if _but(other, k) == _but(world, k)
            ):
                continue
            curves: list[Curve] = []
            for place, variant in enumerate(manifest.variants):
                shift = apart * (place - 0.5 * (len(manifest.variants) - 1))
                points = _points(rows, variant, _but(world, k), k)
                curves += _curves(points, shift, robot_style(place))
            panels.append(
                Panel(f"{' · '.join(_but(world, k))}: {_SUCCESS}", curves, floor=0.0, span=100.0)
            )
        margin = 0.04 * (values[-1] - values[0])
        grid = PanelGrid(values[0] - margin, values[-1] + margin, height=220.0, across=sweep.name)
        legend = [(robot_style(i), name) for i, name in enumerate(manifest.variants)]
        figure = draw_panels(panels, grid, legend=legend)
        yield sweep.name, Drawing(figure, f"success against {sweep.name}")


Point = tuple[float, float, float, float]  # swept value; rate and ends of its interval, %


def _points(rows: Rows, variant: str, fixed: tuple[str, ...], k: int) -> list[Point]:
    points = []
    for group, found in rows.items():
        told = tally(found)
        if group.variant == variant and _but(group.world, k) == fixed and told.trials:
            low, high = told.success
            share = told.successes / told.trials
            points.append((number(group.swept[k]), 100 * share, 100 * low, 100 * high))
    return sorted(points)


def _curves(points: Sequence[Point], shift: float, style: str) -> Iterator[Curve]:
    if not points:
        return
    value, rate, low, high = np.array(points).T
    at = value + shift
    yield Curve(at, rate, style)
    yield Curve(at, rate, style, kind="dots")
    for x, a, b in zip(at, low, high, strict=True):
        yield Curve(np.array([x, x]), np.array([a, b]), style)


def _worlds(rows: Rows) -> list[tuple[str, ...]]:
    """Each world once; scenarios in their order, swept values by size."""
    scenarios = list(dict.fromkeys(group.scenario for group in rows))
    worlds = {group.world for group in rows}
    return sorted(worlds, key=lambda world: (scenarios.index(world[0]), order(world[1:])))


def _but(world: tuple[str, ...], k: int) -> tuple[str, ...]:
    """A world without its k-th swept value."""
    return (*world[: 1 + k], *world[2 + k :])
