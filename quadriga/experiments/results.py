"""What came of some campaigns: of each variant in each world, and beside the baseline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from quadriga.experiments.statistics import Pairs

World = tuple[str, ...]  # scenario, and the value of each swept key as text

ALL: Final = "all worlds"
POOLED: Final[World] = (ALL,)  # the world of the lines of all worlds together
COST: Final = "cost"  # the ratio of control costs, beside those of the RMSE


@dataclass(frozen=True, slots=True)
class Tally:
    """What came of the trials of a group, or of several.

    Attributes:
        trials: those that were walked.
        refused: why others were not; empty if all were.
        successes, falls, stops: of the trials; a stop is one without a fall.
        time_to_fall: median over the falls, s.
        mean_vx, cost_of_transport, control_cost, rmse: medians over the walks to the end.
        slowest, fastest: least and greatest mean vx of the walks to the end, m/s.
        rmse_max: greatest RMSE of a walk to the end.
        planner_ms_p50, planner_ms_p99: medians of the trials' own quantiles.
        plans: how many plans had which status.
    """

    trials: int
    refused: str
    successes: int
    falls: int
    stops: int
    time_to_fall: float | None
    mean_vx: float | None
    cost_of_transport: float | None
    control_cost: float | None
    rmse: Mapping[str, float | None]
    slowest: float | None
    fastest: float | None
    rmse_max: Mapping[str, float | None]
    planner_ms_p50: float | None
    planner_ms_p99: float | None
    plans: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class Ratio:
    """Paired ratios: how many, their median, and the ends of its interval if there are enough."""

    pairs: int
    median: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class Beside:
    """A variant beside the baseline: trials of the same worlds and seeds.

    Attributes:
        fell: pairs by who fell; the first is the variant.
        upright: pairs in which both walked to the end.
        ratios: of control cost and of the RMSE of each of `ERRORS`, variant over baseline, of
            these pairs.
        fell_alone: seeds in which the variant fell and the baseline did not.
        baseline_fell_alone: seeds in which it was the other way round.
    """

    fell: Pairs
    upright: int
    ratios: Mapping[str, Ratio]
    fell_alone: tuple[int, ...] = ()
    baseline_fell_alone: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Line:
    """What came of a variant in a world, or in all of them together.

    Attributes:
        world: of the trials, or `POOLED`.
        variant: its name.
        wanted: trials there should be.
        done: trials there are, refused ones included.
        wall_s: what they took, s of one core.
        tally: what came of them.
        beside: against the baseline; None for that itself, or without any pair.
        radius: of the iteration of the agents' plans, of all worlds together the largest; None if
            there is no such iteration, or nobody has noted it.
    """

    world: World
    variant: str
    wanted: int
    done: int
    wall_s: float
    tally: Tally
    beside: Beside | None
    radius: float | None = None


@dataclass(frozen=True, slots=True)
class Results:
    """Everything that tables and figures are made of.

    Attributes:
        baseline: the variant that others are compared with.
        variants: names in order.
        worlds: in order, `POOLED` not among them.
        swept: headings of the swept values of a world.
        lines: of every world and variant that has a trial, then of all worlds together.
        seeds: of the trials there are.
        versions: of code and libraries that they were walked with.
        lines_against: the same lines beside another variant than the baseline, by its name.
    """

    baseline: str
    variants: tuple[str, ...]
    worlds: tuple[World, ...]
    swept: tuple[str, ...] = ()
    lines: tuple[Line, ...] = ()
    seeds: tuple[int, ...] = ()
    versions: tuple[str, ...] = ()
    lines_against: Mapping[str, tuple[Line, ...]] = field(default_factory=dict)

    @property
    def others(self) -> list[str]:
        """The variants that are compared with the baseline."""
        return [name for name in self.variants if name != self.baseline]

    @property
    def wall_s(self) -> float:
        """What all trials took, s of one core."""
        return sum(line.wall_s for line in self.lines if line.world != POOLED)

    def find(self, world: World, variant: str, against: str = "") -> Line | None:
        """The line of a variant in a world, beside the baseline or another variant."""
        lines = self.lines_against[against] if against else self.lines
        return next((ln for ln in lines if (ln.world, ln.variant) == (world, variant)), None)
