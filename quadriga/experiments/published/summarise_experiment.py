"""From the campaigns of an experiment to its results."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.plan import Group
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.results import Results
from quadriga.experiments.summarise import build_lines
from quadriga.experiments.trial.outcome import TrialOutcome

CampaignTrials = tuple[Manifest, Sequence[TrialOutcome]]  # what a campaign's folder holds


def summarise_experiment(experiment: Experiment, campaigns: Sequence[CampaignTrials]) -> Results:
    """What came of an experiment so far.

    Trials of worlds, variants or seeds that its file does not name, or names with other keys, are
    left out: they are of an experiment that it was before.
    """
    keys = {variant.name: dict(variant.keys) for variant in experiment.variants}
    groups, seeds = _groups_by_sweep(experiment), set(experiment.seeds)
    rows: list[TrialOutcome] = []
    for manifest, trials in campaigns:
        same = {name for name in keys if manifest.variants.get(name) == keys[name]}
        mine = groups.get(tuple(sweep.name for sweep in manifest.sweeps), set())
        rows += [
            row for row in trials if row.group in mine and row.variant in same and row.seed in seeds
        ]
    worlds = tuple(experiment.worlds())
    sweeps = any(part.sweep for part in experiment.parts)
    build = partial(
        build_lines,
        rows,
        dict.fromkeys(experiment.groups(), len(seeds)),
        pooled=len(worlds) > 1 and not sweeps,
        radii={
            entry.group: entry.radius
            for manifest, _ in campaigns
            for entry in manifest.groups
            if entry.radius is not None
        },
    )
    others = {requirement.against for requirement in experiment.requirements} - {""}
    return Results(
        baseline=experiment.baseline,
        variants=tuple(keys),
        worlds=worlds,
        swept=("swept",) if sweeps else (),
        lines=build(experiment.baseline),
        lines_against={other: build(other) for other in sorted(others)},
        seeds=tuple(sorted({row.seed for row in rows})),
        versions=tuple(
            dict.fromkeys(manifest.versions for manifest, _ in campaigns) if rows else ()
        ),
    )


def count_trials(experiment: Experiment, results: Results) -> tuple[int, int]:
    """Trials there are, and trials there should be."""
    wanted = len(experiment.seeds) * len(experiment.groups())
    groups = {(group.world, group.variant) for group in experiment.groups()}
    done = sum(line.done for line in results.lines if (line.world, line.variant) in groups)
    return done, wanted


def _groups_by_sweep(experiment: Experiment) -> dict[tuple[str, ...], set[Group]]:
    """Its groups by what is swept in them: the same values of another key are other worlds."""
    groups: dict[tuple[str, ...], set[Group]] = {}
    for part in experiment.parts:
        worlds = set(part.worlds())
        swept = tuple(sweep.name for sweep in part.sweeps)
        groups.setdefault(swept, set()).update(
            group for group in experiment.groups() if group.world in worlds
        )
    return groups
