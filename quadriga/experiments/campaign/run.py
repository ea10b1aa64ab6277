"""SHELL of `quadriga campaign`: predictors, then trials side by side, then the report."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from importlib import import_module
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.campaign.bar import Bar
from quadriga.experiments.campaign.job import TrialJob, origin, walk
from quadriga.experiments.campaign.ledger import Ledger, kept_in, read_manifest, write_text
from quadriga.experiments.campaign.manifest import FILE, GroupEntry, Manifest, SweepEntry
from quadriga.experiments.campaign.outcome import TrialOutcome, to_columns
from quadriga.experiments.campaign.plan import CampaignPlan, Group
from quadriga.experiments.campaign.predictors import Fitted, prepared
from quadriga.shared.config.reference_trace import trace_sha256
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.config.write import config_sha256, to_toml
from quadriga.shared.errors import ConfigError
from quadriga.warm_up import warm_up
from quadriga.workers import run_each

Walks = Callable[
    [Sequence[TrialJob], int, str], Generator[tuple[TrialJob, TrialOutcome], None, None]
]

CONFIGS: Final = "configs"
PARQUET: Final = "trials.parquet"


def run(
    plan: CampaignPlan, out: Path, *, jobs: int, dask: str | None, typed: str, console: Console
) -> None:
    """Walk every trial of a plan that the folder does not hold yet.

    Args:
        plan: what to walk.
        out: a new folder, or one of a campaign to go on with.
        jobs: processes that walk side by side.
        dask: address of a scheduler whose workers walk; None walks in processes of this machine.
        typed: the command, for the report.
        console: for progress.

    Raises:
        ConfigError: the folder is in use, cannot be written to, or holds trials that do not belong
            to these.
        PredictorFileError: a predictor's file, or that of its data, is gone or damaged.
        ProcessError: a worker died, or is not of this version.
    """
    walks = each_walk if dask is None else _dask()
    if (out / FILE).is_file():  # before anything is collected and fitted with other code
        read_manifest(out).check_versions(origin(), out)
    warm_up(next(iter(plan.configs.values())), console)
    fitted = prepared(plan.configs.values(), console)
    manifest = manifest_for(plan, fitted, typed)
    with Ledger(out, manifest) as ledger, kept_in(out):
        _write_configs(out, plan.configs)
        done = {(row.group, row.seed) for row in ledger.rows}
        traces = {group: trace_sha256(config) for group, config in plan.configs.items()}
        todo = [
            TrialJob(
                group,
                seed,
                plan.configs[group],
                fitted[plan.configs[group]],
                manifest.versions,
                traces[group],
            )
            for group, seed in plan.trials()
            if (group, seed) not in done
        ]
        wanted = len(plan.seeds) * len(plan.configs)
        if todo:
            with (
                Bar(console, wanted, wanted - len(todo)) as bar,
                closing(walks(todo, min(jobs, len(todo)), dask or "")) as found,
            ):
                for _, row in found:
                    ledger.append(row)
                    bar.advance(row)
        write_parquet(out / PARQUET, ledger.rows, ledger.manifest)


def each_walk(
    todo: Sequence[TrialJob], jobs: int, _address: str
) -> Generator[tuple[TrialJob, TrialOutcome], None, None]:
    """Jobs with their outcomes, walked in processes of this machine."""
    return run_each(walk, todo, jobs)


def write_parquet(path: Path, rows: Sequence[TrialOutcome], manifest: Manifest) -> None:
    """The rows as Parquet too, where pyarrow is installed; sorted, so that equal rows are equal."""
    try:
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        return
    ordered = sorted(rows, key=lambda row: (row.group, row.seed))
    table = arrow.table(to_columns(ordered, [sweep.key for sweep in manifest.sweeps]))
    partial = path.with_name(f"{path.name}.partial")
    parquet.write_table(table, partial, compression="zstd")
    partial.replace(path)


def config_file(folder: Path, group: Group) -> Path:
    """The whole configuration of a group; `--seed` makes it that of a trial."""
    return folder / CONFIGS / f"{group.name}.toml"


def _write_configs(out: Path, configs: Mapping[Group, Config]) -> None:
    (out / CONFIGS).mkdir(exist_ok=True)
    for group, config in configs.items():
        # A walk by this file then takes a free endpoint, so that several can go at once.
        usual = config.bus.endpoint == BusConfig().endpoint
        write_text(config_file(out, group), to_toml(config, ["bus.endpoint"] if usual else []))


def manifest_for(plan: CampaignPlan, fitted: Mapping[Config, Fitted], typed: str) -> Manifest:
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
                _digest(config),
                fitted[config].sha256,
                tuple(sorted(plan.seeds)),
            )
            for group, config in plan.configs.items()
        ),
        versions=origin(),
    )


def _digest(config: Config) -> str:
    """Of the configuration, and of the trace that it names."""
    trace = trace_sha256(config)
    mine = config_sha256(config)
    return mine if not trace else hashlib.sha256(f"{mine}{trace}".encode()).hexdigest()


def _dask() -> Walks:
    try:
        module = import_module("quadriga.experiments.campaign.dask_workers")
    except ModuleNotFoundError as error:
        raise ConfigError(
            "--dask",
            f"no package {error.name!r}",
            "the extra 'campaign'",
            "pip install -e '.[campaign]' in the checkout, or leave --dask out",
        ) from None
    found: Walks = module.each_done
    return found
