"""The options of the benchmark's command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Options:
    """Which parts, how large and how long.

    Attributes:
        parts: names of the parts, in order.
        robots: sizes of the teams that walk.
        seconds: world time of each walk.
        planner: `planner.kind` of the walks.
        quick: whether every part is as small as possible.
        out: the JSON file.
    """

    parts: tuple[str, ...]
    robots: tuple[int, ...]
    seconds: float
    planner: str
    quick: bool
    out: Path

    @property
    def middle(self) -> int:
        """The size of the team in the low-level and recorder parts: 3 unless only others walk."""
        return min(self.robots, key=lambda n: abs(n - 3))
