"""Rows of an experiment's campaigns as what is published of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from quadriga.experiments.campaign.analysis import against, by_group, tally
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.campaign.outcome import TrialOutcome
from quadriga.experiments.campaign.plan import Group
from quadriga.experiments.campaign.report import span, spanned
from quadriga.experiments.campaign.sheets import ALL
from quadriga.experiments.campaign.statistics import median, median_interval
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.published.results import Beside, Line, Ratio, Results

POOLED: Final = (ALL,)  # the world of the lines of all worlds together
Walked = tuple[Manifest, Sequence[TrialOutcome]]  # what a campaign's folder holds


def summarise(experiment: Experiment, campaigns: Sequence[Walked]) -> Results:
    """What came of an experiment so far.

    Trials of worlds, variants or seeds that its file does not name, or names with other keys, are
    left out: they are of an experiment that it was before.
    """
    keys = {variant.name: dict(variant.keys) for variant in experiment.variants}
    groups, seeds = _groups_by_sweep(experiment), set(experiment.seeds)
    rows: list[TrialOutcome] = []
    for manifest, found in campaigns:
        same = {name for name in keys if _same(keys[name], manifest.variants.get(name))}
        mine = groups.get(tuple(sweep.name for sweep in manifest.sweeps), set())
        rows += [
            row for row in found if row.group in mine and row.variant in same and row.seed in seeds
        ]
    rows.sort(key=lambda row: (row.group, row.seed))  # in whichever order they were walked
    wanted = len(seeds)
    base = [row for row in rows if row.variant == experiment.baseline]
    beside = {name: None if name == experiment.baseline else base for name in keys}
    found_rows = by_group(rows)
    lines = [
        _line(group.world, group.variant, wanted, found_rows[group], beside[group.variant])
        for group in experiment.groups()
        if group in found_rows
    ]
    if len(experiment.worlds()) > 1 and not any(part.sweep for part in experiment.parts):
        for name in keys:
            of_name = [row for row in rows if row.variant == name]
            total = wanted * len(experiment.worlds())
            lines += [_line(POOLED, name, total, of_name, beside[name])] if of_name else []
    return Results(
        versions=tuple(dict.fromkeys(manifest.versions for manifest, _ in campaigns)),
        baseline=experiment.baseline,
        variants={
            name: mine for name, mine in keys.items() if any(row.variant == name for row in rows)
        },
        seeds=span([row.seed for row in rows]),
        lines=tuple(lines),
    )


def fitting(experiment: Experiment, results: Results) -> Results:
    """What of published results the experiment's file, which may have changed, still stands for."""
    if not spanned(results.seeds) <= set(experiment.seeds):
        return Results()
    keys = {variant.name: dict(variant.keys) for variant in experiment.variants}
    same = {name for name in keys if _same(keys[name], results.variants.get(name))}
    compared = results.baseline == experiment.baseline and experiment.baseline in same
    worlds = experiment.worlds()
    whole = {line.world for line in results.lines} - {POOLED} == set(worlds)
    lines = [
        replace(
            line,
            wanted=max(line.wanted, len(experiment.seeds) * _times(line, worlds)),
            beside=line.beside if compared else None,
        )
        for line in results.lines
        if line.variant in same and (whole if line.world == POOLED else line.world in worlds)
    ]
    return replace(results, lines=tuple(lines)) if lines else Results()


def done(experiment: Experiment, results: Results) -> tuple[int, int]:
    """Trials there are, and trials there should be."""
    there = {Group(line.scenario, line.variant, line.world[1:]): line for line in results.lines}
    found = [there.get(group) for group in experiment.groups()]
    return (
        sum(line.done for line in found if line is not None),
        sum(len(experiment.seeds) if line is None else line.wanted for line in found),
    )


def _groups_by_sweep(experiment: Experiment) -> dict[tuple[str, ...], set[Group]]:
    """Its groups by what is swept in them: the same values of another key are other worlds."""
    found: dict[tuple[str, ...], set[Group]] = {}
    for part in experiment.parts:
        worlds = set(part.worlds())
        swept = tuple(sweep.name for sweep in part.sweeps)
        found.setdefault(swept, set()).update(
            group for group in experiment.groups() if group.world in worlds
        )
    return found


def _times(line: Line, worlds: Sequence[tuple[str, ...]]) -> int:
    return len(worlds) if line.world == POOLED else 1


def _same(mine: Mapping[str, Any], theirs: Mapping[str, Any] | None) -> bool:
    return theirs is not None and mine == dict(theirs)


def _line(
    world: tuple[str, ...],
    variant: str,
    wanted: int,
    rows: Sequence[TrialOutcome],
    base: Iterable[TrialOutcome] | None,
) -> Line:
    return Line(
        scenario=world[0],
        swept=world[1] if len(world) > 1 else "",
        variant=variant,
        wanted=wanted,
        done=len(rows),
        wall_s=sum(row.wall_s for row in rows),
        tally=tally(rows),
        beside=None if base is None else _beside(rows, base),
    )


def _beside(rows: Sequence[TrialOutcome], base: Iterable[TrialOutcome]) -> Beside | None:
    found = against(rows, base)
    if not found.fell.total:
        return None
    ratios = {}
    for name, values in found.ratios.items():
        low, high = median_interval(values) or (None, None)
        ratios[name] = Ratio(len(values), median(values), low, high)
    return Beside(found.fell, found.upright, ratios)
