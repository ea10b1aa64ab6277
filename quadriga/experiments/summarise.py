"""From the rows of trials to what came of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

from quadriga.experiments.plan import Group
from quadriga.experiments.results import COST, POOLED, Beside, Line, Ratio, Tally
from quadriga.experiments.statistics import Pairs, median, median_interval
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.recordings.traces import ERRORS


def build_lines(
    rows: Sequence[TrialOutcome],
    wanted: Mapping[Group, int],
    baseline: str,
    *,
    pooled: bool,
    radii: Mapping[Group, float] | None = None,
) -> tuple[Line, ...]:
    """A line for each group that has a trial, then for each variant in all worlds together.

    Args:
        rows: of the trials.
        wanted: how many trials of each group there should be, in the order of the lines.
        baseline: the variant that the others are compared with.
        pooled: whether there are lines of all worlds together.
        radii: of the iteration of the agents' plans, by group.
    """
    known = radii or {}
    groups: dict[Group, list[TrialOutcome]] = {group: [] for group in wanted}
    for row in sorted(rows, key=lambda row: row.seed):
        groups[row.group].append(row)
    variants = dict.fromkeys(group.variant for group in wanted)
    of_variant = {
        name: [row for group, trials in groups.items() if group.variant == name for row in trials]
        for name in variants
    }
    base = of_variant.get(baseline, [])

    def build_line(world: tuple[str, ...], name: str, rows: list[TrialOutcome], of: int) -> Line:
        beside = None if name == baseline else compare_with_baseline(rows, base)
        spent = sum(row.wall_s for row in rows)
        noted = [known[group] for group in {row.group for row in rows} if group in known]
        radius = max(noted, default=None)
        return Line(world, name, of, len(rows), spent, tally_trials(rows), beside, radius)

    lines = [
        build_line(group.world, group.variant, trials, wanted[group])
        for group, trials in groups.items()
        if trials
    ]
    if pooled:
        for name, trials in of_variant.items():
            of = sum(count for group, count in wanted.items() if group.variant == name)
            lines += [build_line(POOLED, name, trials, of)] if trials else []
    return tuple(lines)


def tally_trials(rows: Sequence[TrialOutcome]) -> Tally:
    """What came of some trials."""
    walked = [row for row in rows if not row.refused]
    upright = [row for row in walked if row.success]
    plans: Counter[str] = Counter()
    for row in walked:
        plans.update(row.count_plans())
    speeds = [row.mean_vx for row in upright if row.mean_vx is not None]
    return Tally(
        trials=len(walked),
        refused=next((row.refused for row in rows if row.refused), ""),
        successes=len(upright),
        falls=sum(row.fell for row in walked),
        stops=sum(not row.success and not row.fell for row in walked),
        time_to_fall=_median(row.time_to_fall_s for row in walked),
        mean_vx=_median(speeds),
        cost_of_transport=_median(row.cost_of_transport for row in upright),
        control_cost=_median(row.control_cost for row in upright),
        rmse={name: _median(row.rmse(name) for row in upright) for name in ERRORS},
        slowest=min(speeds, default=None),
        fastest=max(speeds, default=None),
        rmse_max={
            name: max(_drop_missing(row.rmse(name) for row in upright), default=None)
            for name in ERRORS
        },
        planner_ms_p50=_median(row.planner_ms_p50 for row in walked),
        planner_ms_p99=_median(row.planner_ms_p99 for row in walked),
        plans=dict(plans),
    )


def compare_with_baseline(
    rows: Iterable[TrialOutcome], baseline: Iterable[TrialOutcome]
) -> Beside | None:
    """Trials of a variant beside the baseline's in the same worlds; None if there is no pair."""
    theirs = {(row.group.world, row.seed): row for row in baseline if not row.refused}
    pairs = [
        (row, theirs[row.group.world, row.seed])
        for row in rows
        if not row.refused and (row.group.world, row.seed) in theirs
    ]
    if not pairs:
        return None
    upright = [(mine, base) for mine, base in pairs if mine.success and base.success]
    return Beside(
        fell=Pairs.of([(mine.fell, base.fell) for mine, base in pairs]),
        upright=len(upright),
        ratios={name: _build_ratio(upright, name) for name in (COST, *ERRORS)},
        fell_alone=tuple(mine.seed for mine, base in pairs if mine.fell and not base.fell),
        baseline_fell_alone=tuple(mine.seed for mine, base in pairs if base.fell and not mine.fell),
    )


def find_worst(rows: Iterable[TrialOutcome], count: int) -> list[TrialOutcome]:
    """The trials that went worst: the earliest falls, then stops, then the greatest cost."""

    def badness(row: TrialOutcome) -> tuple[bool, float, float, int]:
        fall = -(row.time_to_fall_s if row.time_to_fall_s is not None else float("inf"))
        return not row.success, fall, row.control_cost or 0.0, -row.seed

    walked = [row for row in rows if not row.refused]
    return sorted(walked, key=badness, reverse=True)[:count]


def _build_ratio(pairs: Iterable[tuple[TrialOutcome, TrialOutcome]], name: str) -> Ratio:
    values = list(_divide(pairs, name))
    low, high = median_interval(values) or (None, None)
    return Ratio(len(values), _round(median(values)), _round(low), _round(high))


def _divide(pairs: Iterable[tuple[TrialOutcome, TrialOutcome]], name: str) -> Iterator[float]:
    for mine, base in pairs:
        one, other = (row.control_cost if name == COST else row.rmse(name) for row in (mine, base))
        if one is not None and other:
            yield one / other


def _drop_missing(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _median(values: Iterable[float | None]) -> float | None:
    return _round(median(_drop_missing(values)))


def _round(value: float | None) -> float | None:
    """To twelve digits: the last bits of a quotient must not decide on a digit that is shown.

    Far more digits than are shown, so that a value is not rounded twice: a table tells what its
    trials tell.
    """
    return None if value is None else float(f"{value:.12g}")
