"""What the operator asked for, and which of it is in force at a tick."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from quadriga.agents.predictor.episode import output_base
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Reference
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import SAMPLE_MS

AHEAD_MS: Final = 1000  # how far ahead of the present a message may speak
_KEPT_MS = 2000  # long enough for the windows of the oldest plan that may still be used


def remember_references(
    known: tuple[Reference, ...], new: Iterable[Reference], tick: int
) -> tuple[Reference, ...]:
    """The references worth keeping at `tick`, one per tick (the first to come), oldest first."""
    fresh = tuple(new)
    if not fresh:
        return known
    by_tick = {item.tick: item for item in (*reversed(fresh), *reversed(known))}
    ordered = [by_tick[key] for key in sorted(by_tick)]
    # The newest of the old ones stays in force at the far end of the window.
    first = sum(item.tick <= tick - _KEPT_MS for item in ordered)
    return tuple(ordered[max(0, first - 1) :])


def reference_at(
    references: tuple[Reference, ...], tick: int, height: float
) -> tuple[Reference, int]:
    """The reference in force at `tick` and its age [ms]; standing still before the first."""
    for item in reversed(references):
        if item.tick <= tick:
            return item, tick - item.tick
    return Reference(0, 0, 0.0, 0.0, 0.0, height), tick


def base_of_window(
    config: Config, end: int, references: tuple[Reference, ...], now: int | None = None
) -> Array:
    """Base of the outputs at the ends of the T_ini samples up to the tick `end`. (T_ini, 6).

    For samples after the tick `now` it is that of `now`.
    """
    height = config.reference.height
    ticks = range(end - SAMPLE_MS * (config.planner.T_ini - 1), end + 1, SAMPLE_MS)
    known = [tick if now is None else min(tick, now) for tick in ticks]
    first, last = (reference_at(references, tick, height)[0] for tick in (known[0], known[-1]))
    if first is last:  # as nearly always
        return np.tile(output_base(config, last), (len(known), 1))
    return np.array([output_base(config, reference_at(references, t, height)[0]) for t in known])
