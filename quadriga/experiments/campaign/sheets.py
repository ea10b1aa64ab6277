"""The tables of a campaign: for each scenario what became of each variant, and how surely."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Final

from quadriga.experiments.campaign.analysis import COST, Against, Tally, against, tally
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.campaign.outcome import TrialOutcome
from quadriga.experiments.campaign.plan import Group
from quadriga.experiments.campaign.statistics import (
    mcnemar,
    median,
    median_interval,
    paired_difference,
)
from quadriga.recordings.traces import ERRORS
from quadriga.tables import NOTHING, Table, format_number, format_output, label_output

ALL: Final = "all worlds"
POOLED_NOTE: Final = (
    f"{ALL.capitalize()}: pairs of every world together. Where one seed gives similar worlds (the "
    "same boxes, higher) they are not independent, and intervals and p say too much."
)
Rows = Mapping[Group, Sequence[TrialOutcome]]
Line = tuple[str, tuple[str, ...], list[TrialOutcome]]  # variant, swept values, its rows


def outcome_sheets(manifest: Manifest, rows: Rows) -> list[Table]:
    """Success, falls, efforts, a table for each scenario."""
    columns = (
        "trials",
        "success",
        "95 %",
        "fell",
        "stopped",
        "time to fall [s]",
        "mean vx [m/s]",
        "cost of transport",
        "plan p50 [ms]",
        "p99 [ms]",
        "plans",
    )
    notes = (
        "Success: every robot walked to the end; interval: Wilson, 95 %. Medians: time to fall "
        "over the falls; mean vx and cost of transport (∑|τ·q̇|dt / (m g d), payload included) over "
        "the walks to the end; plan times over the trials' own quantiles, on a loaded machine.",
    )
    return [
        _sheet(f"{scenario}: what became of the walks", manifest, columns, lines, _outcome, notes)
        for scenario, lines in _scenarios(manifest, rows)
    ]


def tracking_sheets(manifest: Manifest, rows: Rows) -> list[Table]:
    """The RMSE of each of `ERRORS`, a table for each scenario."""
    columns = tuple(label_output(name) for name in ERRORS)
    notes = (
        "Root mean square errors over the steady part, all robots; medians over the walks to the "
        "end. z: over the terrain under the hips; z-felt: over the ground that the feet feel.",
    )
    return [
        _sheet(f"{scenario}: tracking errors", manifest, columns, lines, _tracking, notes)
        for scenario, lines in _scenarios(manifest, rows)
    ]


def fall_sheets(manifest: Manifest, rows: Rows, baseline: str) -> list[Table]:
    """Falls of every variant beside the baseline's: for each scenario, and for all together."""
    columns = (
        "pairs",
        "fell",
        f"{baseline} fell",
        "fell alone",
        f"{baseline} alone",
        "difference [points]",
        "95 %",
        "McNemar p",
    )
    notes = (
        f"Pairs: the same world and seed with '{baseline}'. Difference of the fall rates, negative "
        "where the variant falls less, with Newcombe's 95 % interval for paired proportions; p of "
        "McNemar's exact two-sided test, each of a single test, not corrected for their number.",
    )
    return _beside(manifest, rows, baseline, "falls", columns, _falls, notes)


def ratio_sheets(manifest: Manifest, rows: Rows, baseline: str) -> list[Table]:
    """Errors of every variant over the baseline's: for each scenario, and for all together."""
    columns = ("pairs", COST, *ERRORS)
    notes = (
        f"Pairs that both walked to the end: RMSE, and control cost, over that of '{baseline}'. "
        "Median, in brackets its exact 95 % interval (order statistics; six pairs at least).",
    )
    return _beside(manifest, rows, baseline, "errors", columns, _ratios, notes)


def _beside(
    manifest: Manifest,
    rows: Rows,
    baseline: str,
    what: str,
    columns: Sequence[str],
    cells: Callable[[Against], Iterable[str]],
    notes: Sequence[str],
) -> list[Table]:
    theirs = [row for group, found in rows.items() if group.variant == baseline for row in found]
    scenarios = [
        (scenario, [line for line in lines if line[0] != baseline])
        for scenario, lines in _scenarios(manifest, rows)
    ]
    if len({group.world for group in rows}) > 1:
        every = [line for _, lines in scenarios for line in lines]
        swept = ("all",) * len(manifest.sweeps)
        scenarios.append(
            (
                ALL,
                [
                    (
                        name,
                        swept,
                        [row for variant, _, mine in every if variant == name for row in mine],
                    )
                    for name in dict.fromkeys(line[0] for line in every)
                ],
            )
        )
    return [
        _sheet(
            f"{scenario}: {what} against {baseline}",
            manifest,
            columns,
            lines,
            lambda mine: cells(against(mine, theirs)),
            (*notes, POOLED_NOTE) if scenario == ALL else notes,
        )
        for scenario, lines in scenarios
        if lines
    ]


def _scenarios(manifest: Manifest, rows: Rows) -> Iterator[tuple[str, list[Line]]]:
    """Lines of each scenario in the order of the campaign: swept values, variants within them."""
    variants = list(manifest.variants)
    groups = sorted(
        (entry.group for entry in manifest.groups if entry.group in rows),
        key=lambda group: (order(group.swept), variants.index(group.variant)),
    )
    for scenario in dict.fromkeys(entry.scenario for entry in manifest.groups):
        lines = [(g.variant, g.swept, list(rows[g])) for g in groups if g.scenario == scenario]
        if lines:
            yield scenario, lines


def order(swept: Iterable[str]) -> tuple[tuple[float, str], ...]:
    """Numbers by value, before texts by letter."""
    return tuple((number(value), value) for value in swept)


def number(value: str) -> float:
    """A swept value as a number; infinite if it is none."""
    try:
        return float(value)
    except ValueError:
        return float("inf")


def _sheet(
    title: str,
    manifest: Manifest,
    columns: Sequence[str],
    lines: Sequence[Line],
    cells: Callable[[Sequence[TrialOutcome]], Iterable[str]],
    notes: Sequence[str],
) -> Table:
    head = ("variant", *(sweep.name for sweep in manifest.sweeps), *columns)
    body, refused = [], []
    for variant, swept, mine in lines:
        row = [variant, *swept, *cells(mine)]
        body.append((*row, *(NOTHING,) * (len(head) - len(row))))
        if why := tally(mine).refused:
            refused.append(f"{' · '.join((variant, *swept))}: refused: {why}.")
    return Table(title, head, tuple(body), (*notes, *refused))


def _outcome(rows: Sequence[TrialOutcome]) -> Iterator[str]:
    found = tally(rows)
    if not found.trials:
        yield from ("0", "refused")
        return
    low, high = found.success
    yield str(found.trials)
    yield f"{100 * found.successes / found.trials:.1f} %"
    yield unbroken(f"{100 * low:.1f} … {100 * high:.1f}")
    yield str(found.falls)
    yield str(found.stops)
    yield format_number(found.time_to_fall, ".2f")
    yield format_number(found.mean_vx, ".3f")
    yield format_number(found.cost_of_transport, ".2f")
    yield format_number(found.planner_ms_p50, ".2f")
    yield format_number(found.planner_ms_p99, ".2f")
    yield _shares(found)


def _tracking(rows: Sequence[TrialOutcome]) -> Iterator[str]:
    found = tally(rows)
    for name in ERRORS:
        yield format_output(name, found.rmse[name])


def _falls(found: Against) -> Iterator[str]:
    pairs = found.fell
    yield str(pairs.total)
    if not pairs.total:
        return
    difference, low, high = paired_difference(pairs)
    yield str(pairs.both + pairs.first)
    yield str(pairs.both + pairs.second)
    yield str(pairs.first)
    yield str(pairs.second)
    yield f"{100 * difference:+.1f}"
    yield unbroken(f"{100 * low:+.1f} … {100 * high:+.1f}")
    yield p_text(mcnemar(pairs))


def _ratios(found: Against) -> Iterator[str]:
    yield str(found.upright)
    for name in (COST, *ERRORS):
        yield _ratio(found.ratios[name])


def p_text(p: float) -> str:
    """A p value with two digits that say something."""
    return "< 0.0001" if p < 1e-4 else f"{p:.2g}"


def _ratio(values: Sequence[float]) -> str:
    middle, ends = median(values), median_interval(values)
    if middle is None:
        return NOTHING
    return f"{middle:.2f}" + (
        "" if ends is None else " " + unbroken(f"[{ends[0]:.2f}, {ends[1]:.2f}]")
    )


def unbroken(text: str) -> str:
    """A text that no line ends in."""
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def _shares(found: Tally) -> str:
    total = sum(found.plans.values())
    ranked = sorted(found.plans.items(), key=lambda item: -item[1])
    shares = (unbroken(f"{name} {100 * count / total:.3g} %") for name, count in ranked)
    return ", ".join(shares) or NOTHING
