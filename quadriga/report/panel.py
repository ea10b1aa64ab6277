"""What a figure over world time is made of: curves or bars in panels, and marks across them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from quadriga.shared.robot.a1 import Array


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve: times (k,) in s, values (k,), its class in the style sheet.

    Attributes:
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
    """One row of bars: its name, and (begin s, end s, class) of each."""

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


@dataclass(frozen=True, slots=True)
class Mark:
    """A time that every panel shows, s: its class in the style sheet and its name."""

    time: float
    style: str
    name: str


@dataclass(frozen=True, slots=True)
class Box:
    """A panel's place: left, top, width, height in px, and the times at its sides in s."""

    x: float
    y: float
    w: float
    h: float
    begin: float
    end: float

    def at(self, time: Array) -> Array:
        """Where times stand, px from the figure's left side."""
        scaled: Array = self.x + self.w * (time - self.begin) / (self.end - self.begin)
        return scaled
