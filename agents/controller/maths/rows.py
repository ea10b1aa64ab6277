"""Flat rows of numbers, and NamedTuples that say what is where in them.

A row is cheap to hand to compiled code: one array, whatever is in it. A NamedTuple costs 1 µs and
more there, so that from Python rows are handed over and compiled code takes them apart.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
from numba.np.unsafe.ndarray import to_fixed_tuple

from quadriga.shared.messages import cuts_of
from quadriga.shared.robots.conventions import Array


def places(**sizes: int) -> dict[str, Any]:
    """Where parts of these sizes are in a row, one behind the other.

    The place of a single number is its index, that of several a slice.
    """
    cuts = cuts_of(sizes)
    return {name: cut.start if sizes[name] == 1 else cut for name, cut in cuts.items()}


def row_size(layout: NamedTuple) -> int:
    """The size of the row that `layout`, made of `places`, describes."""
    last: slice | int = layout[-1]
    return int(last.stop) if isinstance(last, slice) else last + 1


def _plain_numbers(row: Array, count: int) -> tuple[float, ...]:
    assert len(row) == count
    return tuple(row)


# The numbers of a row, (count,), as a tuple. Compiled code needs `count` to be a constant.
numbers: Callable[[Array, int], tuple[float, ...]] = (
    _plain_numbers if numba.config.DISABLE_JIT else to_fixed_tuple
)
