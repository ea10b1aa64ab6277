"""The command `experiments`. It imports what it needs: every process reads the command line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.console import Console

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

if TYPE_CHECKING:
    from quadriga.experiments.published.experiment import Experiment
    from quadriga.experiments.published.walk import PartPlan
    from quadriga.tables import Table

LOOKS: Final = "looks"  # the folder of walks that are not published


def experiments(arguments: argparse.Namespace, _config: Config, _given: dict[str, Any]) -> int:
    """Walk what is missing of experiments and publish what came of all; or only take a look."""
    from quadriga.commands.campaign_options import dask_of
    from quadriga.experiments.published.catalogue import CHECKOUT, load
    from quadriga.experiments.published.publish import PAGE, publish, walked
    from quadriga.experiments.published.sheets import requirement_sheet, sheets
    from quadriga.experiments.published.summarise import summarise
    from quadriga.experiments.published.walk import take_up
    from quadriga.experiments.trial.variants import seeds_of

    _check_options(arguments)
    every, asked = load(arguments.names)
    chosen = [experiment for experiment in every if experiment.name in asked]
    dask = dask_of(arguments, "names")
    if arguments.seeds:
        seeds, runs = seeds_of("--seeds", arguments.seeds), arguments.out / LOOKS
        for experiment, plans in _planned([replace(one, seeds=seeds) for one in chosen], runs):
            _walk(arguments, experiment, plans, runs, dask)
            found = summarise(experiment, list(walked(experiment, runs).values()))
            _show(experiment, sheets(experiment, found))
        return 0
    into, runs = arguments.into or CHECKOUT, arguments.out
    todo = [] if arguments.only_publish else _planned(chosen, runs)
    renewed = asked
    if arguments.only_publish and not arguments.names:
        renewed = [one.name for one in every if _of_this_code(one, runs)]
    # That all can be read and written is better known before hours of walking.
    entries = publish(every, runs, into, renewed, _say)
    if arguments.from_published:
        for experiment, plans in todo:
            taken = take_up(
                experiment, plans, into, runs, typed=arguments.typed, console=Console(stderr=True)
            )
            _say(f"{experiment.name}: {taken:,} published trials taken up")
    for experiment, plans in todo:
        _walk(arguments, experiment, plans, runs, dask)
        entries = publish(every, runs, into, renewed, _say)
    for entry in entries:
        if entry.experiment.name in asked:
            _show(entry.experiment, [requirement_sheet(entry.experiment, entry.results)])
    print(into / PAGE)
    return 0


def _planned(chosen: Iterable[Experiment], runs: Path) -> list[tuple[Experiment, list[PartPlan]]]:
    """Campaigns of experiments that can be walked, or gone on with."""
    from quadriga.experiments.published.walk import check_folders, plans_of

    planned = [(experiment, plans_of(experiment)) for experiment in chosen]
    for experiment, _ in planned:
        check_folders(experiment, runs)
    return planned


def _of_this_code(experiment: Experiment, runs: Path) -> bool:
    """Whether an experiment's runs may be published although nobody named it."""
    from quadriga.experiments.campaign.job import origin
    from quadriga.experiments.campaign.ledger import read_manifest
    from quadriga.experiments.campaign.manifest import FILE

    folders = [experiment.folder(runs, part) for part in experiment.parts]
    versions = {read_manifest(one).versions for one in folders if (one / FILE).is_file()}
    if versions <= {origin()}:
        return True
    _say(
        f"{experiment.name}: what is published stays; {runs / experiment.name} was walked with "
        "other code or libraries (its name publishes it)"
    )
    return False


def _say(text: str) -> None:
    print(f"quadriga: {text}", file=sys.stderr)


def _walk(
    arguments: argparse.Namespace,
    experiment: Experiment,
    plans: list[PartPlan],
    runs: Path,
    dask: str | None,
) -> None:
    from quadriga.experiments.published.walk import walk

    walk(
        experiment,
        plans,
        runs,
        jobs=arguments.jobs,
        dask=dask,
        typed=arguments.typed,
        console=Console(stderr=True),
    )


def _show(experiment: Experiment, tables: Iterable[Table]) -> None:
    """Tables made for Markdown, on a terminal."""
    from quadriga.tables import print_tables

    print_tables(
        replace(
            sheet,
            title=f"{experiment.title}: {sheet.title}",
            rows=tuple(tuple(cell.replace("**", "") for cell in row) for row in sheet.rows),
        )
        for sheet in tables
        if sheet.rows
    )


def _check_options(arguments: argparse.Namespace) -> None:
    given = {**arguments.overrides, "--config": arguments.config, "--scenario": arguments.scenario}
    for name, value in given.items():
        if value is not None:
            raise ConfigError(
                name, str(value), "no key", "those of an experiment stand in its file"
            )
    if arguments.only_publish and arguments.seeds:
        raise ConfigError("--seeds", repr(arguments.seeds), "none", "--only-publish walks nothing")
    if arguments.from_published and (arguments.only_publish or arguments.seeds):
        raise ConfigError(
            "--from-published",
            "an option beside it",
            "neither --only-publish nor --seeds",
            "it says where walking goes on",
        )
