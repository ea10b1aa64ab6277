"""SHELL of walking experiments: each of their campaigns, as `quadriga campaign` walks them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from quadriga.experiments.campaign.ledger import read_manifest
from quadriga.experiments.campaign.manifest import FILE
from quadriga.experiments.campaign.walk_trials import Workers, build_manifest, walk_campaign
from quadriga.experiments.campaign.write_report import write_report
from quadriga.experiments.plan import CampaignPlan, Group, build_plan
from quadriga.experiments.predictors import prepare_predictors
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.published_trials import read_published_manifest, unpack_trials
from quadriga.experiments.trial.origin import code_and_libraries
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import ConfigError

PartPlan = tuple[Part, CampaignPlan]  # one of an experiment's campaigns, and its trials


def build_plans(experiment: Experiment) -> list[PartPlan]:
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


def config_digests(experiment: Experiment) -> dict[Group, str]:
    """The digest of each group's configuration, as it is today.

    Raises:
        ConfigError: as `build_plans`.
    """
    return {
        group: config_sha256(config)
        for _, plan in build_plans(experiment)
        for group, config in plan.configs.items()
    }


def check_responses(experiment: Experiment, plans: Sequence[PartPlan]) -> None:
    """Refuse to begin without the measured responses that a variant plans with.

    Raises:
        ConfigError: there is no such file.
    """
    for _, plan in plans:
        for config in plan.configs.values():
            path = Path(config.response_file)
            if config.response_file and not path.is_file():
                raise ConfigError(
                    f"{experiment.name}: identification.response",
                    f"no file {path}",
                    "measured responses",
                    f"`quadriga probe --robots {config.team.robots} --out {path.parent}` first",
                )


def check_folders(experiment: Experiment, runs: Path) -> None:
    """Refuse to go on with trials of other code, before anything is walked.

    Raises:
        ConfigError: a campaign's folder holds such trials, or is none.
    """
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        if (folder / FILE).is_file():
            read_manifest(folder).check_versions(code_and_libraries(), folder)


def unpack_published(
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
        manifest = read_published_manifest(experiment, part, into)
        if manifest is None:
            continue
        try:
            manifest.check_versions(code_and_libraries(), folder)  # before anything is collected
            fitted = prepare_predictors(plan.configs.values(), console)
            manifest.merge(build_manifest(plan, fitted, typed), folder)
        except ConfigError as error:
            raise ConfigError(
                f"--from-published: {experiment.name}",
                error.got,
                error.expected,
                "without the option all is walked anew",
            ) from None
        taken += unpack_trials(experiment, part, into, runs)
    return taken


def walk_experiment(
    experiment: Experiment,
    plans: Sequence[PartPlan],
    runs: Path,
    *,
    workers: Workers,
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
        walk_campaign(plan, folder, workers=workers, typed=typed, console=console)
        write_report(folder, console=console)
