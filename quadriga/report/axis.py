"""Round values along an axis, and its scale."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from quadriga.shared.robot.a1 import Array

_LOG_FLOOR: Final = 1e-3


def grid(low: float, high: float, length: float, least: float) -> list[float]:
    """As many round values from `low` to `high` as stand `least` px apart on an axis of `length`.

    Two at least, unless `low` and `high` are one.
    """
    room = max(2, int(length // least))
    found = [nice(low, high, count) for count in range(1, room + 3)]
    fitting = [values for values in found if len(values) <= room]
    return max(fitting or found[:1], key=len)


def nice(low: float, high: float, count: int) -> list[float]:
    """Round values from `low` to `high`, some `count` of them."""
    step = (high - low) / max(count, 1)
    power = 10.0 ** math.floor(math.log10(max(step, 1e-12)))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= step * (1 - 1e-9))
    digits = max(0, -math.floor(math.log10(step)) + 1)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [round(k * step, digits) + 0.0 for k in range(first, last + 1)]


def decades(low: float, high: float) -> list[float]:
    exponents = range(math.floor(low), math.ceil(high) + 1)
    factors = (1.0,) if high - low > 2.5 else (1.0, 2.0, 5.0)
    return [round(m * 10.0**k, 6) for k in exponents for m in factors]


def same(values: Array) -> Array:
    return values


def logarithm(values: Array) -> Array:
    logs: Array = np.log10(np.maximum(values, _LOG_FLOOR))
    return logs
