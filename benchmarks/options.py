"""What the command line of the benchmark asks for."""

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
        quick: everything tiny.
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
        """The size of team that has figures of its own: 3 unless only others walk."""
        return min(self.robots, key=lambda n: abs(n - 3))
