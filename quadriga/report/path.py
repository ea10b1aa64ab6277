"""Curves as compact SVG paths: thinned out to what can be seen, in relative tenths of a pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.a1 import Array

TENTH = 10.0  # units of a path's coordinates per pixel


def broken(time: Array, values: Array, longest: float) -> tuple[Array, Array]:
    """The same curve with a gap (NaN) wherever samples are more than `longest` apart."""
    at = np.flatnonzero(np.diff(time) > longest) + 1
    return np.insert(time, at, np.nan), np.insert(values, at, np.nan)


def segments(x: Array, y: Array) -> list[tuple[Array, Array]]:
    """The parts of a curve between points that are not finite; at least one point each."""
    good = np.isfinite(x) & np.isfinite(y)
    return [(x[a:b], y[a:b]) for a, b in spells(good)]


def spells(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and index after the last of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def thinned(x: Array, y: Array, columns: int) -> tuple[Array, Array]:
    """At most some two points for each of `columns` columns: the least and the greatest there.

    Peaks survive, as they would not if every k-th point were taken.

    Args:
        x: ascending, shape (k,).
        y: shape (k,).
        columns: how many may tell points apart.
    """
    if len(x) <= 2 * columns:
        return x, y
    column = ((x - x[0]) / max(x[-1] - x[0], 1e-12) * columns).astype(np.int64)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    order = np.lexsort((y, column))
    last = np.append(first[1:], len(x)) - 1
    # Sorted by column, then by value: the ends of each column's part are its extremes.
    kept = np.unique(np.concatenate([order[first], order[last], [0, len(x) - 1]]))
    return x[kept], y[kept]


def line(x: Array, y: Array) -> str:
    """A path through points in pixels; a single point becomes a dot."""
    X, Y = _tenths(x), _tenths(y)
    steps = [_pair(dx, dy) for dx, dy in zip(np.diff(X), np.diff(Y), strict=True) if dx or dy]
    return f"M{_pair(X[0], Y[0])}" + (f"l{' '.join(steps)}" if steps else "h0")


def staircase(x: Array, y: Array, last: float) -> str:
    """A path whose value at each point is held until the next one, the last until `last`."""
    X, Y = _tenths(x), _tenths(y)
    moves = [
        f"h{dx}v{dy}" if dy else f"h{dx}" for dx, dy in zip(np.diff(X), np.diff(Y), strict=True)
    ]
    return f"M{_pair(X[0], Y[0])}{''.join(moves)}H{round(TENTH * last)}"


def dots(x: Array, y: Array) -> str:
    """A path of separate points."""
    return "".join(f"M{_pair(a, b)}h0" for a, b in zip(_tenths(x), _tenths(y), strict=True))


def box(x: float, y: float, width: float, height: float) -> str:
    """A rectangle; never so narrow that it cannot be seen."""
    w, h = max(round(TENTH * width), 5), round(TENTH * height)
    return f"M{_pair(round(TENTH * x), round(TENTH * y))}h{w}v{h}h{-w}z"


def _tenths(values: Array) -> NDArray[np.int64]:
    return np.rint(TENTH * np.clip(values, -1e4, 1e4)).astype(np.int64)


def _pair(a: float, b: float) -> str:
    return f"{a}{b}" if b < 0 else f"{a} {b}"
