"""What the operator asked for, and with it the window and the horizon that a plan is made of."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.predictor.episode import commanded_outputs, output_base
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Reference
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


def base_of_window(config: Config, end: int, references: tuple[Reference, ...], now: int) -> Array:
    """Base of the outputs at the ends of the T_ini samples up to the tick `end`. (T_ini, 6).

    For samples after the tick `now` it is that of `now`.
    """
    height, begin = config.reference.height, end - SAMPLE_MS * (config.planner.T_ini - 1)
    ticks = [min(tick, now) for tick in range(begin, end + 1, SAMPLE_MS)]
    return np.array([output_base(config, reference_at(references, t, height)[0]) for t in ticks])


def is_gapless(samples: tuple[Measurement, ...], count: int, end: int) -> bool:
    """Whether the last `count` samples up to the tick `end` are there."""
    return len(samples) >= count and samples[-count].tick == end - SAMPLE_MS * (count - 1)


def build_planner_inputs(
    config: Config,
    step: int,
    end: int,
    samples: tuple[Measurement, ...],
    references: tuple[Reference, ...],
) -> PlannerInputs:
    """What a planning step consumes of a robot itself.

    `end` is its tick, at which the last of `samples` ends, which are at least T_ini.
    """
    planner, window = config.planner, samples[-config.planner.T_ini :]
    now, _ = reference_at(references, end, config.reference.height)
    return PlannerInputs(
        step=step,
        u_ini=np.array([sample.u for sample in window]),
        y_ini=np.array([sample.y for sample in window]),
        stance_ini=np.array([sample.stance for sample in window]) > 0.5,
        y_base_ini=base_of_window(config, end, references, end),
        y_base=np.repeat(output_base(config, now)[None], planner.N, axis=0),
        y_des=np.repeat(commanded_outputs(now)[None], planner.N, axis=0),
        weight=config.robot.weight,
    )
