"""SHELL of walking experiments: each of their campaigns, as `quadriga campaign` walks them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from quadriga.experiments.campaign.job import origin
from quadriga.experiments.campaign.ledger import read_manifest
from quadriga.experiments.campaign.manifest import FILE
from quadriga.experiments.campaign.plan import CampaignPlan, build_plan
from quadriga.experiments.campaign.predictors import prepared
from quadriga.experiments.campaign.report import report
from quadriga.experiments.campaign.run import manifest_for, run
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.published_trials import manifest_kept, unpack
from quadriga.shared.errors import ConfigError

PartPlan = tuple[Part, CampaignPlan]  # one of an experiment's campaigns, and its trials


def plans_of(experiment: Experiment) -> list[PartPlan]:
    """The campaigns of an experiment.

    Raises:
        ConfigError: a key or a value is wrong, or a world cannot be built.
    """
    return [
        (
            part,
            build_plan(
                part.scenarios,
                experiment.variants,
                part.sweeps,
                experiment.seeds,
                experiment.baseline,
                None,
                {},
            ),
        )
        for part in experiment.parts
    ]


def check_folders(experiment: Experiment, runs: Path) -> None:
    """Refuse to go on with trials of other code, before anything is walked.

    Raises:
        ConfigError: a campaign's folder holds such trials, or is none.
    """
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        if (folder / FILE).is_file():
            read_manifest(folder).check_versions(origin(), folder)


def take_up(
    experiment: Experiment,
    plans: Sequence[PartPlan],
    into: Path,
    runs: Path,
    *,
    typed: str,
    console: Console,
) -> int:
    """Unpack what is published of an experiment, to go on with it.

    Returns:
        How many trials were unpacked; none where the runs hold them already.

    Raises:
        ConfigError: published trials are of other code, libraries, configurations or predictors,
            a folder holds others, or a file cannot be read or written.
    """
    taken = 0
    for part, plan in plans:
        folder = experiment.folder(runs, part)
        manifest = manifest_kept(experiment, part, into)
        if manifest is None:
            continue
        try:
            manifest.check_versions(origin(), folder)  # before anything is collected
            fitted = prepared(plan.configs.values(), console)
            manifest.merged(manifest_for(plan, fitted, typed), folder)
        except ConfigError as error:
            raise ConfigError(
                f"--from-published: {experiment.name}",
                error.got,
                error.expected,
                "without the option all is walked anew",
            ) from None
        taken += unpack(experiment, part, into, runs)
    return taken


def walk(
    experiment: Experiment,
    plans: Sequence[PartPlan],
    runs: Path,
    *,
    jobs: int,
    dask: str | None,
    typed: str,
    console: Console,
) -> None:
    """Walk what is missing of an experiment, and leave a report in each campaign's folder.

    Raises:
        ConfigError: a folder is in use or holds trials that do not belong to these.
        ProcessError: a worker died, or is not of this version.
    """
    for part, plan in plans:
        folder = experiment.folder(runs, part)
        console.print(f"{folder}", markup=False, highlight=False)
        run(plan, folder, jobs=jobs, dask=dask, typed=typed, console=console)
        report(folder, baseline=None, record_worst=0, console=console, shown=False)
