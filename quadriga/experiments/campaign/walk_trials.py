"""SHELL of a campaign: predictors, then trials side by side, each row on the disk at once."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.campaign.configs import write_configs
from quadriga.experiments.campaign.job import TrialJob, walk_trial
from quadriga.experiments.campaign.ledger import Ledger, explain_write_errors, read_manifest
from quadriga.experiments.campaign.manifest import FILE, GroupEntry, Manifest, SweepEntry
from quadriga.experiments.campaign.progress import TrialProgress
from quadriga.experiments.campaign.recordings import record_trial, run_dir_of
from quadriga.experiments.plan import CampaignPlan
from quadriga.experiments.predictors import Fitted, prepare_predictors
from quadriga.experiments.trial.figures_of_merit import Figures
from quadriga.experiments.trial.origin import code_and_libraries, foreign_origin
from quadriga.experiments.trial.outcome import TrialOutcome, to_columns
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.warm_up import warm_up
from quadriga.workers import run_each

Outcomes = Generator[tuple[TrialJob, TrialOutcome], None, None]

PARQUET: Final = "trials.parquet"


@dataclass(frozen=True, slots=True)
class Workers:
    """Who walks the trials.

    Attributes:
        jobs: processes that walk side by side.
        dask: address of a scheduler whose workers walk instead; None for this machine's processes.
        bus: walk each trial as processes of its own over the bus, one trial after the other.
    """

    jobs: int = 1
    dask: str | None = None
    bus: bool = False


def walk_campaign(
    plan: CampaignPlan, out: Path, *, workers: Workers, typed: str, console: Console
) -> None:
    """Walk every trial of a plan that the folder does not hold yet.

    Args:
        plan: what to walk.
        out: a new folder, or one of a campaign to go on with.
        workers: who walks.
        typed: the command, for the report.
        console: for progress.

    Raises:
        ConfigError: the folder is in use, cannot be written to, or holds trials that do not belong
            to these.
        PredictorFileError: a predictor's file, or that of its data, is gone or damaged.
        ProcessError: a worker died, or is not of this version.
    """
    walk = _choose_workers(workers, out)
    if (out / FILE).is_file():  # before anything is collected and fitted with other code
        read_manifest(out).check_versions(code_and_libraries(), out)
    warm_up(next(iter(plan.configs.values())), console)
    fitted = prepare_predictors(plan.configs.values(), console)
    manifest = build_manifest(plan, fitted, typed)
    with Ledger(out, manifest) as ledger, explain_write_errors(out):
        write_configs(out, plan.configs)
        done = {(row.group, row.seed) for row in ledger.rows}
        todo = [
            TrialJob(
                group,
                seed,
                plan.configs[group],
                fitted[plan.configs[group]],
                ledger.manifest.versions,
                foreign_origin(plan.configs[group]),
            )
            for group, seed in plan.trials()
            if (group, seed) not in done
        ]
        wanted = len(plan.seeds) * len(plan.configs)
        if todo:
            with (
                TrialProgress(console, wanted, wanted - len(todo)) as progress,
                closing(walk(todo)) as outcomes,
            ):
                for _, row in outcomes:
                    ledger.append(row)
                    progress.advance(row)
        write_parquet(out / PARQUET, ledger.rows, ledger.manifest)


def write_parquet(path: Path, rows: Sequence[TrialOutcome], manifest: Manifest) -> None:
    """The rows as Parquet too, where pyarrow is installed; sorted, so that equal rows are equal."""
    try:
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        return
    ordered = sorted(rows, key=lambda row: (row.group, row.seed))
    table = arrow.table(to_columns(ordered, [sweep.key for sweep in manifest.sweeps]))
    with atomic_write(path) as partial:
        parquet.write_table(table, partial, compression="zstd")


def build_manifest(plan: CampaignPlan, fitted: Mapping[Config, Fitted], typed: str) -> Manifest:
    """What a campaign of this plan consists of, walked with these predictors by this code."""
    return Manifest(
        typed=(typed,),
        baseline=plan.baseline,
        variants={variant.name: dict(variant.keys) for variant in plan.variants},
        sweeps=tuple(SweepEntry(sweep.key, sweep.name) for sweep in plan.sweeps),
        groups=tuple(
            GroupEntry(
                group.scenario,
                group.variant,
                group.swept,
                config_sha256(config),
                fitted[config].sha256,
                tuple(sorted(plan.seeds)),
                foreign_origin(config),
                fitted[config].radius,
            )
            for group, config in plan.configs.items()
        ),
        versions=code_and_libraries(),
    )


def _choose_workers(workers: Workers, out: Path) -> Callable[[Sequence[TrialJob]], Outcomes]:
    """A function that walks jobs and yields each with its outcome, in the order they are done.

    Controllers of one's own are programs: what they walk is walked over the bus in any case.
    """
    if workers.bus:
        return lambda todo: _walk_over_bus(todo, out)
    walk = _choose_own_workers(workers)

    def walk_all(todo: Sequence[TrialJob]) -> Outcomes:
        own = [job for job in todo if not job.config.team.agent_command]
        if own:
            yield from walk(own)
        yield from _walk_over_bus([job for job in todo if job.config.team.agent_command], out)

    return walk_all


def _choose_own_workers(workers: Workers) -> Callable[[Sequence[TrialJob]], Outcomes]:
    """The same for teams of the project's own agents, without the bus."""
    if workers.dask is None:
        return lambda todo: run_each(walk_trial, todo, min(workers.jobs, len(todo)))
    try:
        dask = import_module("quadriga.experiments.campaign.dask_workers")
    except ModuleNotFoundError as error:
        raise ConfigError(
            "--dask",
            f"no package {error.name!r}",
            "the extra 'campaign'",
            "pip install -e '.[campaign]' in the checkout, or leave --dask out",
        ) from None
    return lambda todo: dask.run_each(todo, min(workers.jobs, len(todo)), workers.dask)


def _walk_over_bus(todo: Sequence[TrialJob], out: Path) -> Outcomes:
    for job in todo:
        run_dir = run_dir_of(out, job.group, job.seed)

        def record(config: Config, fitted: Fitted, run_dir: Path = run_dir) -> Figures:
            return record_trial(config, run_dir, fitted)

        yield job, walk_trial(job, record)
