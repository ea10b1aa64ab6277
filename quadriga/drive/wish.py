"""What a driver asks of the team: speeds and height within limits, changed no faster than they may.

All functions are pure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.runtime.record import record

NAMES: Final = ("vx", "vy", "wz", "height")


@record
class Wish:
    """What a driver asks for: m/s forward, m/s leftward, rad/s of yaw, height of the trunk in m."""

    vx: float
    vy: float
    wz: float
    height: float


def standing(config: Config) -> Wish:
    """Stand where the team is, at the configured height."""
    return Wish(0.0, 0.0, 0.0, config.reference.height)


def limits() -> Mapping[str, tuple[float, float]]:
    """By name the least and the greatest that can be asked for, as `reference.*` permits it."""
    keys = {name: ReferenceConfig.__dataclass_fields__[name].metadata for name in NAMES}
    return {name: (meta["low"], meta["high"]) for name, meta in keys.items()}


def limit(wish: Wish) -> Wish:
    """The nearest wish within the limits."""
    return Wish(*(float(np.clip(getattr(wish, name), *limits()[name])) for name in NAMES))


def approach(before: Wish, wish: Wish, most: Mapping[str, float]) -> Wish:
    """What is asked for next, on the way from `before` to `wish`.

    Args:
        before: what was asked for last.
        wish: within the limits.
        most: by name how far it may change at once.
    """
    return Wish(
        *(_towards(getattr(before, name), getattr(wish, name), most[name]) for name in NAMES)
    )


def _towards(value: float, goal: float, most: float) -> float:
    return float(np.clip(goal, value - most, value + most))
