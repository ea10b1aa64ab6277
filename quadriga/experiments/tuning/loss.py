"""How well a candidate walks, held against the start in the same worlds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from statistics import fmean
from typing import Final

from quadriga.experiments.trial.outcome import TrialOutcome

# The errors that a planner can correct; the height's jumps with the terrain.
_ERRORS: Final = ("z-over-stance-feet", "vx", "vy", "roll", "pitch", "wz")
_REFUSED: Final = 4.0  # worse than any walk

World = tuple[str, int]  # scenario and seed
Walks = Mapping[World, TrialOutcome]


def by_world(rows: Iterable[TrialOutcome]) -> dict[World, TrialOutcome]:
    """Trials of one candidate by their world."""
    return {(row.scenario, row.seed): row for row in rows}


def loss(walks: Walks, start: Walks, seconds: float) -> float:
    """Mean cost of early ends, and mean log ratio of the errors to those of the start.

    A walk to the end costs nothing, one that ends at t of T costs 2 − t/T; so does a team that gave
    up and hangs in its yokes until the time is over, which costs 1. Errors count over the
    pairs of which both walked to the end: ten percent more of every error cost as much as a tenth
    of the walks that fall at the very end.

    Args:
        walks: of the candidate.
        start: of the start, in the same worlds.
        seconds: T, the length of a whole walk, s.
    """
    lost = fmean(_lost(walk, seconds) for walk in walks.values())
    return lost + _log_ratio(walks, start)


def _lost(walk: TrialOutcome, seconds: float) -> float:
    if walk.refused:
        return _REFUSED
    return 0.0 if walk.success else 2.0 - min(1.0, walk.seconds / seconds)


def _log_ratio(walks: Walks, start: Walks) -> float:
    ratios = []
    for world, walk in walks.items():
        other = start[world]
        if not (walk.success and other.success):
            continue
        for error in _ERRORS:
            mine, its = walk.rmse(error), other.rmse(error)
            if mine and its:
                ratios.append(math.log(mine / its))
    return fmean(ratios) if ratios else 0.0
