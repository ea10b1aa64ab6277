"""Curves as they are drawn: thinned out to what can be seen, broken where samples are missing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadriga.charts.panels import Curve
from quadriga.shared.robots.conventions import Array


def find_spells(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and index after the last of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def break_at_gaps(time: Array, values: Array, longest: float) -> tuple[Array, Array]:
    """The same curve with NaN wherever samples are more than `longest` apart."""
    at = np.flatnonzero(np.diff(time) > longest) + 1
    return np.insert(time, at, np.nan), np.insert(values, at, np.nan)


def thin_out(x: Array, y: Array, columns: int) -> tuple[Array, Array]:
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


def visible_points(curve: Curve, begin: float, end: float, points: int) -> tuple[Array, Array]:
    """What is drawn of a curve from `begin` to `end`, s.

    Returns:
        Times and values; NaN separates the parts that are not joined. At most about `points`.
    """
    near = (curve.time >= begin - 1.0) & (curve.time <= end + 1.0)
    time, value = curve.time[near], curve.value[near]
    if curve.gap:
        time, value = break_at_gaps(time, value, curve.gap)
    parts = []
    for a, b in find_spells(np.isfinite(time) & np.isfinite(value)):
        x, y = time[a:b], value[a:b]
        if curve.kind == "step":  # the last value is held for the most of a gap
            x, y = np.append(x, x[-1] + 0.7 * curve.gap), np.append(y, y[-1])
        else:
            x, y = thin_out(x, y, max(2, round(0.5 * points * len(x) / len(time))))
        parts += [np.stack([x, y]), np.full((2, 1), np.nan)]
    if not parts:
        return np.zeros(0), np.zeros(0)
    joined = np.concatenate(parts[:-1], axis=1)
    return joined[0], joined[1]
