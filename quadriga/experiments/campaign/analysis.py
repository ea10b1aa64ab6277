"""Rows as groups, and each variant beside the baseline in the same worlds."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.experiments.campaign.outcome import TrialOutcome
from quadriga.experiments.campaign.plan import Group
from quadriga.experiments.campaign.statistics import Interval, Pairs, median, wilson
from quadriga.recordings.traces import ERRORS

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
    planner_ms_p50: float | None
    planner_ms_p99: float | None
    plans: Mapping[str, int]

    @property
    def success(self) -> Interval:
        """Wilson's interval of the success rate."""
        return wilson(self.successes, self.trials)


@dataclass(frozen=True, slots=True)
class Against:
    """A variant beside the baseline: trials of the same worlds and seeds.

    Attributes:
        fell: pairs by who fell; the first is the variant.
        upright: pairs in which both walked to the end.
        ratios: of control cost and of the RMSE of each of `ERRORS`, variant over baseline, of these
            pairs.
        alone: worlds' seeds in which the variant fell alone.
        spared: those in which the baseline fell alone.
    """

    fell: Pairs
    upright: int
    ratios: Mapping[str, tuple[float, ...]]
    alone: tuple[int, ...]
    spared: tuple[int, ...]


def by_group(rows: Iterable[TrialOutcome]) -> dict[Group, list[TrialOutcome]]:
    """Rows of each group, by seed."""
    groups: defaultdict[Group, list[TrialOutcome]] = defaultdict(list)
    for row in sorted(rows, key=lambda row: row.seed):
        groups[row.group].append(row)
    return dict(groups)


def tally(rows: Sequence[TrialOutcome]) -> Tally:
    """What came of some trials."""
    walked = [row for row in rows if not row.refused]
    whole = [row for row in walked if row.success]
    plans: defaultdict[str, int] = defaultdict(int)
    for name, count in (pair for row in walked for pair in _plans(row)):
        plans[name] += count
    return Tally(
        trials=len(walked),
        refused=next((row.refused for row in rows if row.refused), ""),
        successes=len(whole),
        falls=sum(row.fell for row in walked),
        stops=sum(not row.success and not row.fell for row in walked),
        time_to_fall=_median(row.time_to_fall_s for row in walked),
        mean_vx=_median(row.mean_vx for row in whole),
        cost_of_transport=_median(row.cost_of_transport for row in whole),
        control_cost=_median(row.control_cost for row in whole),
        rmse={name: _median(row.rmse(name) for row in whole) for name in ERRORS},
        planner_ms_p50=_median(row.planner_ms_p50 for row in walked),
        planner_ms_p99=_median(row.planner_ms_p99 for row in walked),
        plans=dict(plans),
    )


def against(rows: Iterable[TrialOutcome], baseline: Iterable[TrialOutcome]) -> Against:
    """Trials of a variant beside those of the baseline in the same worlds."""
    theirs = {(row.group.world, row.seed): row for row in baseline if not row.refused}
    pairs = [
        (row, theirs[row.group.world, row.seed])
        for row in rows
        if not row.refused and (row.group.world, row.seed) in theirs
    ]
    upright = [(mine, base) for mine, base in pairs if mine.success and base.success]
    return Against(
        fell=Pairs.of([(mine.fell, base.fell) for mine, base in pairs]),
        upright=len(upright),
        ratios={name: tuple(_ratios(upright, name)) for name in (COST, *ERRORS)},
        alone=tuple(mine.seed for mine, base in pairs if mine.fell and not base.fell),
        spared=tuple(mine.seed for mine, base in pairs if base.fell and not mine.fell),
    )


def worst(rows: Sequence[TrialOutcome], count: int) -> list[TrialOutcome]:
    """The trials that went worst: the earliest falls, then stops, then the greatest cost."""

    def badness(row: TrialOutcome) -> tuple[bool, float, float]:
        fall = -(row.time_to_fall_s if row.time_to_fall_s is not None else float("inf"))
        return not row.success, fall, row.control_cost or 0.0

    walked = [row for row in rows if not row.refused]
    return sorted(walked, key=lambda row: (*badness(row), -row.seed), reverse=True)[:count]


def _ratios(pairs: Iterable[tuple[TrialOutcome, TrialOutcome]], name: str) -> Iterator[float]:
    for mine, base in pairs:
        one, other = (
            (row.control_cost if name == COST else row.rmse(name)) for row in (mine, base)
        )
        if one is not None and other:
            yield one / other


def _plans(row: TrialOutcome) -> Iterator[tuple[str, int]]:
    for part in filter(None, row.plans.split(", ")):
        name, _, count = part.rpartition("=")
        yield name, int(count)


def _median(values: Iterable[float | None]) -> float | None:
    return median([value for value in values if value is not None])
