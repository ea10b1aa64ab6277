"""Experiments, and campaigns of theirs that nobody walked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from quadriga.experiments.campaign.ledger import Ledger
from quadriga.experiments.campaign.manifest import GroupEntry, Manifest, SweepEntry
from quadriga.experiments.plan import Group
from quadriga.experiments.published.experiment import Experiment, Part, Published, Requirement
from quadriga.experiments.published.page import PageEntry
from quadriga.experiments.published.publish import publish
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.experiments.variants import Variant
from tests.quadriga.experiments.rows import row

DIGEST = "ab" * 32
Fate = Callable[[Group, int], dict[str, Any]]  # changes of the row of a trial


def checkout(folder: Path) -> Path:
    """A folder with docs to publish in."""
    (folder / "docs").mkdir(parents=True, exist_ok=True)
    return folder


def experiment_of(*scenarios: str, **changes: Any) -> Experiment:
    """Variants `none` and `mine` in these scenarios, seeds 0 … 9."""
    fields: dict[str, Any] = {
        "name": "small", "title": "Small", "question": "Is it so?",
        "parts": (Part("", scenarios),),
        "variants": (
            Variant("none", {"planner.kind": "none"}), Variant("mine", {"team.robots": 2}),
        ),
        "baseline": "none", "seeds": tuple(range(10)),
        "published": Published(
            ("trials", "success"), True, ("cost", "roll"), ("success", "falls"),
        ),
        "requirements": (Requirement("success", "least", 97.0, variants=("mine",)),),
    }  # fmt: skip
    return Experiment(**fields | changes)


def rows_of(groups: Iterable[Group], seeds: Iterable[int], fate: Fate) -> list[TrialOutcome]:
    """A row for each trial; all walk to the end but for what `fate` says."""
    return [
        replace(
            row(group.variant, seed, **fate(group, seed)),
            scenario=group.scenario,
            swept=group.swept,
        )
        for seed in seeds
        for group in groups
    ]


def manifest_of(experiment: Experiment, part: int = 0, **changes: Any) -> Manifest:
    """Of one of its campaigns, as its file says."""
    sweeps = tuple(SweepEntry(s.key, s.name) for s in experiment.parts[part].sweeps)
    worlds = set(experiment.parts[part].worlds())
    fields: dict[str, Any] = {
        "typed": ("quadriga experiments",), "baseline": experiment.baseline,
        "variants": {variant.name: dict(variant.keys) for variant in experiment.variants},
        "sweeps": sweeps, "versions": "code 1",
        "groups": tuple(
            GroupEntry(g.scenario, g.variant, g.swept, DIGEST, "", experiment.seeds)
            for g in experiment.groups() if g.world in worlds
        ),
    }  # fmt: skip
    return Manifest(**fields | changes)


def write_runs(
    experiment: Experiment, runs: Path, seeds: Iterable[int], fate: Fate, versions: str = "code 1"
) -> None:
    """The folders of its campaigns with a row for each of these seeds."""
    for k, part in enumerate(experiment.parts):
        mine = manifest_of(experiment, k, versions=versions)
        rows = rows_of([entry.group for entry in mine.groups], seeds, fate)
        with Ledger(experiment.folder(runs, part), mine) as ledger:
            for one in rows:
                ledger.append(replace(one, versions=versions))


def upright(_group: Group, _seed: int) -> dict[str, Any]:
    """Everybody walks to the end."""
    return {}


def publish_all(
    experiments: Iterable[Experiment], runs: Path, into: Path, today: str = DIGEST
) -> list[PageEntry]:
    """Publish experiments, the runs of each if it has any; `today` are all digests of today."""
    every = list(experiments)
    return publish(
        every,
        runs,
        into,
        [one.name for one in every],
        {one.name: dict.fromkeys(one.groups(), today) for one in every},
        print,
    )


def files(folder: Path) -> dict[str, bytes]:
    """What a folder holds, by path."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }
