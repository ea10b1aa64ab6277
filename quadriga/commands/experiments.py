"""`quadriga experiments`: what the docs tell results of, walked and published."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from quadriga.commands.campaign import add_workers, read_workers
from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

if TYPE_CHECKING:
    from quadriga.experiments.published.experiment import Experiment
    from quadriga.experiments.published.walk_experiment import PartPlan
    from quadriga.experiments.results import Results
    from quadriga.tables import Table

LOOKS: Final = "looks"  # the folder of walks that are not published


def add(add_command: AddCommand) -> None:
    command = add_command(
        "experiments", run, "walk what the docs tell results of, and publish them"
    )
    command.epilog = (
        "The same command goes on where it ended. Exit status 0 says that results are published, "
        "whether or not they meet what is required; with --require 1 says that they do not."
    )
    option = command.add_argument
    option("names", nargs="*", metavar="NAME", help="of deploy/experiments, or a TOML file (all)")
    option("--list", action="store_true", help="list all experiments, and walk none")
    option(
        "--only-publish",
        action="store_true",
        help="walk nothing: draw tables and figures from the runs there are, or from what is "
        "published",
    )
    option(
        "--seeds", metavar="LIST", help="a quick look at these instead, 0:2: shown, not published"
    )
    option(
        "--require",
        action="store_true",
        help="exit status 1 unless everything that is required, but for moonshots, is met",
    )
    option(
        "--from-published",
        action="store_true",
        help="go on from the published trials, if they are of this code, these libraries and "
        "the same predictors, instead of walking anew what --out does not hold",
    )
    add_workers(command)
    option(
        "--out",
        type=Path,
        default=Path("runs/experiments"),
        metavar="DIR",
        help="where campaigns are kept, to go on with (%(default)s)",
    )
    option(
        "--into",
        type=Path,
        metavar="DIR",
        help="the checkout whose docs/ are written (this code's)",
    )


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Walk what is missing of experiments and publish what came of all; or only take a look."""
    from quadriga.experiments.published.catalogue import load_experiments

    _check_options(arguments)
    every, asked = load_experiments(arguments.names)
    if arguments.list:
        _list(every)
        return 0
    chosen = [experiment for experiment in every if experiment.name in asked]
    outcomes = _look(arguments, chosen) if arguments.seeds else _publish(arguments, every, asked)
    return int(arguments.require and not all(_meets(one, results) for one, results in outcomes))


def _list(experiments: Iterable[Experiment]) -> None:
    from quadriga.tables import Table, print_tables

    rows = tuple((experiment.name, experiment.title) for experiment in experiments)
    print_tables([Table("Experiments", ("name", "what"), rows)])


def _look(
    arguments: argparse.Namespace, chosen: list[Experiment]
) -> list[tuple[Experiment, Results]]:
    """Walk other seeds, and show the tables."""
    from quadriga.experiments.published.page import build_tables
    from quadriga.experiments.published.publish import read_campaigns
    from quadriga.experiments.published.summarise_experiment import summarise_experiment
    from quadriga.experiments.seeds import parse_seeds

    seeds, runs = parse_seeds("--seeds", arguments.seeds), arguments.out / LOOKS
    looks = []
    for experiment, plans in _build_plans([replace(one, seeds=seeds) for one in chosen], runs):
        _walk(arguments, experiment, plans, runs)
        results = summarise_experiment(experiment, list(read_campaigns(experiment, runs).values()))
        _show(experiment, build_tables(experiment, results))
        looks.append((experiment, results))
    return looks


def _publish(
    arguments: argparse.Namespace, every: list[Experiment], asked: list[str]
) -> list[tuple[Experiment, Results]]:
    """Walk what is missing, publish after each experiment, and show what is required."""
    from rich.console import Console

    from quadriga.experiments.published.catalogue import CHECKOUT
    from quadriga.experiments.published.publish import PAGE, publish
    from quadriga.experiments.published.requirement_table import build_requirement_table
    from quadriga.experiments.published.walk_experiment import config_digests, unpack_published

    into, runs = arguments.into or CHECKOUT, arguments.out
    chosen = [experiment for experiment in every if experiment.name in asked]
    todo = [] if arguments.only_publish else _build_plans(chosen, runs)
    renewed = asked
    if arguments.only_publish and not arguments.names:
        renewed = [one.name for one in every if _is_of_this_code(one, runs)]
    # That all can be read and written is better known before hours of walking.
    digests = {experiment.name: config_digests(experiment) for experiment in every}
    entries = publish(every, runs, into, renewed, digests, say)
    if arguments.from_published:
        for experiment, plans in todo:
            count = unpack_published(
                experiment, plans, into, runs, typed=arguments.typed, console=Console(stderr=True)
            )
            say(f"{experiment.name}: {count:,} published trials taken up")
    for experiment, plans in todo:
        _walk(arguments, experiment, plans, runs)
        entries = publish(every, runs, into, renewed, digests, say)
    shown = [(one.experiment, one.results) for one in entries if one.experiment.name in asked]
    for experiment, results in shown:
        _show(experiment, [build_requirement_table(experiment, results)])
    print(into / PAGE)
    return shown


def _meets(experiment: Experiment, results: Results) -> bool:
    """Whether everything that is required, but for moonshots, is met and walked to the last."""
    from quadriga.experiments.published.verdicts import judge_requirements

    return all(
        (verdict.word == "met" and verdict.whole) or verdict.requirement.moonshot
        for verdict in judge_requirements(experiment, results)
    )


def _build_plans(
    chosen: Iterable[Experiment], runs: Path
) -> list[tuple[Experiment, list[PartPlan]]]:
    """Campaigns of experiments that can be walked, or gone on with."""
    from quadriga.experiments.published.walk_experiment import (
        build_plans,
        check_folders,
        check_responses,
    )

    plans = [(experiment, build_plans(experiment)) for experiment in chosen]
    for experiment, mine in plans:
        check_folders(experiment, runs)
        check_responses(experiment, mine)
    return plans


def _is_of_this_code(experiment: Experiment, runs: Path) -> bool:
    """Whether an experiment's runs may be published although nobody named it."""
    from quadriga.experiments.campaign.ledger import read_manifest
    from quadriga.experiments.campaign.manifest import FILE
    from quadriga.experiments.trial.origin import code_and_libraries, is_same_code

    folders = [experiment.folder(runs, part) for part in experiment.parts]
    versions = {read_manifest(one).versions for one in folders if (one / FILE).is_file()}
    if all(is_same_code(version, code_and_libraries()) for version in versions):
        return True
    say(
        f"{experiment.name}: what is published stays; {runs / experiment.name} was walked with "
        "other code or libraries (its name publishes it)"
    )
    return False


def _walk(
    arguments: argparse.Namespace, experiment: Experiment, plans: list[PartPlan], runs: Path
) -> None:
    from rich.console import Console

    from quadriga.experiments.published.walk_experiment import walk_experiment

    walk_experiment(
        experiment,
        plans,
        runs,
        workers=read_workers(arguments, "names"),
        typed=arguments.typed,
        console=Console(stderr=True),
    )


def _show(experiment: Experiment, tables: Iterable[Table]) -> None:
    """Tables made for Markdown, on a terminal."""
    from quadriga.tables import print_tables

    print_tables(
        replace(
            table,
            title=f"{experiment.title}: {table.title}",
            rows=tuple(tuple(cell.replace("**", "") for cell in row) for row in table.rows),
        )
        for table in tables
        if table.rows
    )


def _check_options(arguments: argparse.Namespace) -> None:
    read_workers(arguments, "names")
    if arguments.only_publish and arguments.seeds:
        raise ConfigError("--seeds", repr(arguments.seeds), "none", "--only-publish walks nothing")
    if arguments.from_published and (arguments.only_publish or arguments.seeds):
        raise ConfigError(
            "--from-published",
            "an option beside it",
            "neither --only-publish nor --seeds",
            "it says where walking goes on",
        )
