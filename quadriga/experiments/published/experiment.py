"""An experiment: campaigns, what is published of them, and what they are measured against."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from quadriga.experiments.plan import Group
from quadriga.experiments.results import World
from quadriga.experiments.sweep import Sweep
from quadriga.experiments.variants import Variant
from quadriga.team.scenarios import label

Bound = Literal["value", "lower", "upper"]
Sense = Literal["least", "most", "below"]
BOUNDS: Final[tuple[Bound, ...]] = ("value", "lower", "upper")
SENSES: Final[tuple[Sense, ...]] = ("least", "most", "below")


@dataclass(frozen=True, slots=True)
class Part:
    """A campaign of its own: all scenarios of an experiment, or one with what is swept in it.

    Attributes:
        folder: within that of the experiment; empty for that folder itself.
        scenarios: names or TOML files.
        sweep: the swept key, if any.
        axis: what a figure calls it.
    """

    folder: str
    scenarios: tuple[str, ...]
    sweep: Sweep | None = None
    axis: str = ""

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        """As a campaign takes them."""
        return () if self.sweep is None else (self.sweep,)

    def worlds(self) -> Iterator[World]:
        """Scenario, and swept value if any, in their order."""
        for scenario in map(label, self.scenarios):
            if self.sweep is None:
                yield (scenario,)
            else:
                yield from ((scenario, value) for value, _ in self.sweep.values)


@dataclass(frozen=True, slots=True)
class Requirement:
    """What a figure must come to.

    Attributes:
        measure: its name, one of `measures.MEASURES`.
        sense: whether it must be at least, at most or below the limit.
        limit: in the measure's unit.
        bound: what is held against it: the estimate, or an end of its 95 % interval.
        variants: whose figure; none are all but the baseline.
        scenarios: where; none are all.
        each: whether it is asked for in each world alone.
        pooled: whether it is asked for of all worlds together.
        moonshot: whether it is hoped for rather than required.
        against: the variant that a paired measure compares with; empty for the baseline.
        at_least: in how many worlds it must be met; 0 for all.
    """

    measure: str
    sense: Sense
    limit: float
    bound: Bound = "value"
    variants: tuple[str, ...] = ()
    scenarios: tuple[str, ...] = ()
    each: bool = True
    pooled: bool = False
    moonshot: bool = False
    against: str = ""
    at_least: int = 0


@dataclass(frozen=True, slots=True)
class Published:
    """Which tables and figures there are.

    Attributes:
        outcome: columns of the table of each variant alone; none leaves it out.
        falls: whether there is a table of falls against the baseline.
        ratios: columns of the table of paired ratios; none leaves it out.
        figures: names of figures.
    """

    outcome: tuple[str, ...]
    falls: bool
    ratios: tuple[str, ...]
    figures: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Experiment:
    """What a file of `deploy/experiments` says.

    Attributes:
        name: of the file.
        title: a headline.
        question: what it shows, in one or two sentences.
        parts: its campaigns.
        variants: with the keys that all have in common.
        baseline: the variant that the others are compared with.
        seeds: of the worlds.
        published: tables and figures.
        requirements: in the order of the file.
    """

    name: str
    title: str
    question: str
    parts: tuple[Part, ...]
    variants: tuple[Variant, ...]
    baseline: str
    seeds: tuple[int, ...]
    published: Published
    requirements: tuple[Requirement, ...]

    def folder(self, within: Path, part: Part) -> Path:
        """The folder of one of its campaigns, where `within` has one for each experiment."""
        return within / self.name / part.folder

    def worlds(self) -> list[World]:
        """Every world, scenario by scenario."""
        return [world for part in self.parts for world in part.worlds()]

    def groups(self) -> list[Group]:
        """Trials that differ by their seed alone, world by world, variants within them."""
        return [
            Group(world[0], variant.name, world[1:])
            for world in self.worlds()
            for variant in self.variants
        ]
