"""What a chart is made of: curves or bars in panels, and marks across them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.shared.robots.conventions import Array

TIME: Final = "time [s]"
DEGREES: Final = (180.0 / math.pi, "°")  # beside rad and rad/s
# What is read beside each of `OUTPUTS` in SI units, as in `Panel.beside`.
BESIDE: Final = (None, None, None, DEGREES, DEGREES, (DEGREES[0], "°/s"))
LEFT: Final = 58.0  # points, for the values of the vertical axis


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve.

    Attributes:
        time: shape (k,), s.
        value: shape (k,).
        style: a key of `colours.LINES`.
        kind: line, step (held until the next point) or dots.
        gap: points further apart than this, s, are not joined; 0 joins all.
    """

    time: Array
    value: Array
    style: str
    kind: str = "line"
    gap: float = 0.0


@dataclass(frozen=True, slots=True)
class Bars:
    """One row of bars: its name, and (begin s, end s, a key of `colours.BARS`) of each."""

    name: str
    bars: Sequence[tuple[float, float, str]]


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes: curves, or rows of bars.

    Attributes:
        title: what is drawn, with its unit.
        span: least range of the values, so that what is nearly constant does not look like noise.
        until: curves choose the range up to this time, s; what leaves it later is cut off.
        floor: the range reaches down to this value.
        ceiling: the range reaches no further up than this.
        log: whether values are drawn logarithmically.
        levels: horizontal lines at (value, name).
        part: its own first and last time, s, instead of the grid's.
        across: its own horizontal axis, with its unit, instead of the grid's.
        beside: for values that are also read in another unit, at the right: how many of it are
            one, and its sign.
    """

    title: str
    curves: Sequence[Curve] = ()
    rows: Sequence[Bars] = ()
    span: float = 0.0
    until: float = math.inf
    floor: float | None = None
    ceiling: float = math.inf
    log: bool = False
    levels: Sequence[tuple[float, str]] = ()
    part: tuple[float, float] | None = None
    across: str = ""
    beside: tuple[float, str] | None = None


@dataclass(frozen=True, slots=True)
class Mark:
    """A time that every panel shows, s: a key of `colours.LINES`, and its name."""

    time: float
    style: str
    name: str


@dataclass(frozen=True, slots=True)
class PanelGrid:
    """What the panels of a chart share.

    Attributes:
        begin: time at the left end, s; or whatever else `across` names.
        end: time at the right end, s.
        columns: panels in a row.
        height: of a panel of curves, points.
        across: the horizontal axis, with its unit.
        points: that a curve may have at most.
    """

    begin: float
    end: float
    columns: int = 1
    height: float = 90.0
    across: str = TIME
    points: int = 1600
