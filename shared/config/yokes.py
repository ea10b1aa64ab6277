"""Which robots of a team are yoked to each other."""

from __future__ import annotations

import itertools


def yoke_pairs(n: int, graph: str) -> tuple[tuple[int, int], ...]:
    """Pairs of robots (0-based) that a yoke connects: `complete`, `chain`, `ring` or `none`."""
    if graph == "none":
        return ()
    if graph == "complete":
        return tuple(itertools.combinations(range(n), 2))
    chain = tuple((i, i + 1) for i in range(n - 1))
    return (*chain, (0, n - 1)) if graph == "ring" and n > 2 else chain


def neighbours(n: int, graph: str, i: int) -> tuple[int, ...]:
    """Robots (0-based) that a yoke connects to robot `i`, in order."""
    return tuple(j for j in range(n) if (min(i, j), max(i, j)) in yoke_pairs(n, graph))
