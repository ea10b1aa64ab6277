"""Figures, mostly over world time, as inline SVG in the colours of the page's style."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from html import escape
from typing import Final

import numpy as np

from quadriga.report import path
from quadriga.report.axis import decades, grid, logarithm, same
from quadriga.report.panel import Box, Curve, Mark, Panel

WIDTH: Final = 1000.0  # px of the drawing; the page scales it
TIME: Final = "time [s]"
_LEFT, _RIGHT, _ABOVE, _BETWEEN, _BELOW = 58.0, 14.0, 20.0, 8.0, 36.0
_LINE, _NARROW, _WIDE = 15.0, 40.0, 60.0  # px between values of an axis, at least


def draw(
    panels: Sequence[Panel],
    begin: float,
    end: float,
    *,
    marks: Sequence[Mark] = (),
    columns: int = 1,
    height: float = 90.0,
    points: int = 1600,
    name: str = "",
    across: str = TIME,
    left: float = _LEFT,
) -> str:
    """An SVG of panels that share the time from `begin` to `end`, s, row by row.

    Or anything else that `across` names: what is said of times here is then said of that.

    Args:
        panels: the panels; `columns` of them stand side by side.
        begin: time at the left end, s.
        end: time at the right end, s.
        marks: times to mark in all panels.
        columns: panels in a row.
        height: of a panel of curves, px; rows of bars take 15 px each.
        points: that a curve may have at most.
        name: what the figure shows, for who does not see it.
        across: what the panels share, with its unit.
        left: room for names of rows and values, px.
    """
    end = max(end, begin + 1e-3)
    width = (WIDTH - columns * (left + _RIGHT)) / columns
    parts, places, y = [], [], 0.0
    for first in range(0, len(panels), columns):
        row = panels[first : first + columns]
        tall = max(15.0 * len(panel.rows) if panel.rows else height for panel in row)
        for k, panel in enumerate(row):
            box = Box(left + k * WIDTH / columns, y + _ABOVE, width, tall, begin, end)
            bottom = first + k + columns >= len(panels)
            below = across if bottom else ""
            parts.append(_panel(panel, box, marks, points, below=below, top=first == 0))
            places.append(f"{box.x:.0f} {box.w:.0f} {box.y:.0f} {box.h:.0f}")
        y += _ABOVE + tall + _BETWEEN
    y += _BELOW - _BETWEEN
    style = "time" if across == TIME else "other"
    return (
        f'<svg class="{style}" viewBox="0 0 {WIDTH:.0f} {y:.0f}" role="img" '
        f'aria-label="{escape(name)}" data-t="{begin:.4f} {end:.4f}" '
        f'data-p="{",".join(places)}">{"".join(parts)}</svg>'
    )


def _panel(
    panel: Panel, box: Box, marks: Sequence[Mark], points: int, *, below: str, top: bool
) -> str:
    inside = "".join(_bars(panel, box)) if panel.rows else "".join(_curves(panel, box, points))
    title = f'<text class="title" x="{box.x:.0f}" y="{box.y - 6:.0f}">{escape(panel.title)}</text>'
    frame = f'<path class="axis" d="M{box.x:.0f} {box.y:.0f}v{box.h:.0f}h{box.w:.0f}"/>'
    free = box.x + 7.0 * len(panel.title) if top else math.inf
    return title + inside + _marks(box, marks, free) + frame + _across(box, below)


def _across(box: Box, name: str) -> str:
    """The axis at the foot of a panel; with values and a name if there is one."""
    ticks = grid(box.begin, box.end, box.w, _NARROW if box.w < 300.0 else _WIDE)
    foot, parts = box.y + box.h, []
    for tick in ticks:
        x = float(box.at(np.array(tick)))
        parts.append(f'<path class="axis" d="M{x:.1f} {foot:.0f}v4"/>')
        if name:
            parts.append(f'<text class="tick mid" x="{x:.1f}" y="{foot + 16:.0f}">{tick:g}</text>')
    if name:
        middle = box.x + box.w / 2
        parts.append(
            f'<text class="tick mid" x="{middle:.0f}" y="{foot + 31:.0f}">{escape(name)}</text>'
        )
    return "".join(parts)


def _marks(box: Box, marks: Sequence[Mark], free: float) -> str:
    """Lines at the marks; their names stand to the right of `free`, px, and of one another."""
    parts = []
    for mark in sorted(marks, key=lambda mark: mark.time):
        if not box.begin <= mark.time <= box.end:
            continue
        x = float(box.at(np.array(mark.time)))
        parts.append(f'<path class="{mark.style}" d="M{x:.1f} {box.y:.0f}v{box.h:.0f}"/>')
        width = 6.5 * len(mark.name)
        if mark.name and x - width > free:  # a name that would cover another is left out
            parts.append(
                f'<text class="tick end {mark.style}" x="{x:.1f}" y="{box.y - 6:.0f}">'
                f"{escape(mark.name)}</text>"
            )
            free = x
    return "".join(parts)


def _bars(panel: Panel, box: Box) -> Iterator[str]:
    tall = box.h / len(panel.rows)
    for k, row in enumerate(panel.rows):
        y = box.y + k * tall
        yield (
            f'<text class="tick end" x="{box.x - 6:.0f}" y="{y + 0.5 * tall + 4:.1f}">'
            f"{escape(row.name)}</text>"
        )
        for style in dict.fromkeys(style for *_, style in row.bars):
            shapes = []
            for begin, stop, which in row.bars:
                if which != style or stop < box.begin or begin > box.end:
                    continue
                left, right = (
                    float(box.at(np.array(t))) for t in (max(begin, box.begin), min(stop, box.end))
                )
                # Bars of what is true lie as a thin line in those of what is scheduled.
                inset = 0.36 if style == "contact" else 0.12
                if style in ("event", "trouble"):
                    left, right = left - 1.5, right + 1.5
                shapes.append(
                    path.box(left, y + inset * tall, right - left, tall * (1 - 2 * inset))
                )
            if shapes:
                kind = f"bar {escape(style)}"
                yield f'<path class="{kind}" transform="scale(.1)" d="{"".join(shapes)}"/>'


def _curves(panel: Panel, box: Box, points: int) -> Iterator[str]:
    scale = logarithm if panel.log else same
    low, high = _range(panel, box)
    for tick in decades(low, high) if panel.log else grid(low, high, box.h, _LINE):
        height = scale(np.array(float(tick)))
        if low <= height <= high:
            y = box.y + box.h * float((high - height) / (high - low))
            yield f'<path class="grid" d="M{box.x:.0f} {y:.1f}h{box.w:.0f}"/>'
            yield f'<text class="tick end" x="{box.x - 6:.0f}" y="{y + 4:.1f}">{tick:,.9g}</text>'
    yield (
        f'<svg x="{box.x:.0f}" y="{box.y:.1f}" width="{box.w:.1f}" height="{box.h:.0f}">'
        '<g transform="scale(.1)">'
    )
    for curve in panel.curves:
        if d := _curve(curve, box, low, high, points, panel):
            yield f'<path class="curve {curve.kind} {escape(curve.style)}" d="{d}"/>'
    for value, name in panel.levels:
        y = 10 * box.h * float((high - scale(np.array(value))) / (high - low))
        if 0.0 < y < 10 * box.h:
            yield f'<path class="level" d="M0 {y:.0f}h{10 * box.w:.0f}"/>'
            yield (
                f'<text class="tick end" font-size="110" x="{10 * box.w - 40:.0f}" '
                f'y="{y - 25:.0f}">{escape(name)}</text>'
            )
    yield "</g></svg>"


def _curve(curve: Curve, box: Box, low: float, high: float, points: int, panel: Panel) -> str:
    scale = logarithm if panel.log else same
    seen = (curve.time >= box.begin - 1.0) & (curve.time <= box.end + 1.0)
    time, value = curve.time[seen], curve.value[seen]
    if curve.gap:
        time, value = path.broken(time, value, curve.gap)
    parts = []
    for x, y in path.segments(box.at(time) - box.x, box.h * (high - scale(value)) / (high - low)):
        # What lies far outside is drawn just outside.
        y = np.clip(y, -box.h, 2 * box.h)
        if curve.kind == "step":
            held = box.w * curve.gap / (box.end - box.begin) if curve.gap else 0.0
            parts.append(path.staircase(x, y, float(x[-1]) + 0.7 * held))
            continue
        columns = max(2, round(0.5 * points * len(x) / max(len(time), 1)))
        x, y = path.thinned(x, y, columns)
        parts.append(path.dots(x, y) if curve.kind == "dots" else path.line(x, y))
    return "".join(parts)


def _range(panel: Panel, box: Box) -> tuple[float, float]:
    """Least and greatest value to draw, with a margin, on the panel's scale."""
    shown = []
    for curve in panel.curves:
        within = (curve.time >= box.begin) & (curve.time <= min(box.end, panel.until))
        shown.append(curve.value[within & np.isfinite(curve.value)])
    values = np.concatenate([np.zeros(0), *shown])
    if panel.floor is not None:
        values = np.append(values, panel.floor)
    if not len(values):
        values = np.zeros(1)
    scaled = (logarithm if panel.log else same)(np.minimum(values, panel.ceiling))
    low, high = float(scaled.min()), float(scaled.max())
    missing = max(panel.span, 1e-9 + 1e-3 * abs(high)) - (high - low)
    if missing > 0.0:
        up = missing if panel.floor is not None else missing / 2
        low, high = low - (missing - up), high + up
    margin = 0.06 * (high - low)
    return low - (0.0 if panel.floor is not None and not panel.log else margin), high + margin
