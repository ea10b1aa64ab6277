"""`quadriga campaign`: variants in the same worlds, many seeds, and a report on all."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.scheduling import count_cores

if TYPE_CHECKING:
    from quadriga.experiments.campaign.walk_trials import Workers
    from quadriga.experiments.plan import CampaignPlan

SEEDS: Final = "0:20"  # of a campaign that names none


def add(add_command: AddCommand) -> None:
    command = add_command("campaign", run, "walk variants in the same worlds, and report on them")
    option = command.add_argument
    option("scenarios", nargs="*", metavar="SCENARIO", help="a scenario's name, or its TOML file")
    option(
        "--planners",
        action="append",
        default=[],
        metavar="LIST",
        help="variants, separated by commas: names of planners ('?' lists them), tables of "
        "--variants, or name:section.key=value;section.key=value (none,distributed)",
    )
    option(
        "--predictors",
        default="",
        metavar="LIST",
        help="every variant that plans with each of these, as planner+predictor; '?' lists them "
        "(the configured one)",
    )
    option("--variants", type=Path, metavar="FILE", help="TOML: a table of keys for each variant")
    option("--baseline", metavar="NAME", help="what others are compared with (none or the first)")
    option("--seeds", metavar="LIST", help=f"of the worlds: 0:20 is 0 … 19; 1,5 is both ({SEEDS})")
    option(
        "--sweep",
        action="append",
        default=[],
        metavar="KEY=V,V",
        help="with each of these values: world.terrain_height=0.04,0.08, or of a text: "
        "'world.push=r1:{80,120}:90:3:0.2'; may be repeated",
    )
    add_workers(command)
    option(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder, new or of a campaign to go on with (runs/<date>-<time>)",
    )
    option(
        "--report",
        type=Path,
        metavar="DIR",
        help="walk nothing: write the report of this folder anew",
    )
    option(
        "--figure",
        type=Path,
        metavar="FILE",
        help="success, falls and errors as one figure: .png, .pdf or .svg",
    )
    option(
        "--record-worst",
        type=int,
        default=0,
        metavar="K",
        help="walk the K worst seeds of each group again over the bus, and link the recordings",
    )


def add_workers(command: argparse.ArgumentParser) -> None:
    """Options that say who walks the trials."""
    option = command.add_argument
    option(
        "--jobs",
        type=_parse_jobs,
        default=count_cores(),
        metavar="N|auto",
        help="walks side by side (auto: one for each core)",
    )
    option(
        "--dask",
        nargs="?",
        const="local",
        metavar="tcp://HOST:PORT",
        help="walk on the workers of a Dask scheduler; without an address on those of a "
        "cluster made here",
    )
    option(
        "--bus",
        action="store_true",
        help="walk each trial as processes of its own over the bus, one after the other, and "
        "keep its recording",
    )


def read_workers(arguments: argparse.Namespace, before: str) -> Workers:
    """The workers asked for; names of what is walked stand `before` the address of a scheduler.

    Raises:
        ConfigError: the scheduler has no address, or is to walk over the bus.
    """
    from quadriga.experiments.campaign.walk_trials import Workers

    dask: str | None = arguments.dask
    if dask not in (None, "local") and "://" not in dask:
        raise ConfigError("--dask", repr(dask), "tcp://HOST:PORT", f"{before} come before it")
    if dask is not None and arguments.bus:
        raise ConfigError("--bus", "--dask beside it", "one of both", "the bus is this machine's")
    return Workers(arguments.jobs, dask, arguments.bus)


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Walk what is missing of a campaign, then report on all of it."""
    from rich.console import Console

    from quadriga.experiments.campaign.figure import check_figure_file, write_figure
    from quadriga.experiments.campaign.walk_trials import walk_campaign
    from quadriga.experiments.campaign.write_report import PAGE, write_report
    from quadriga.tables import print_tables
    from quadriga.team.run_folder import make_run_dir

    console = Console(stderr=True)
    worst = arguments.record_worst
    if worst < 0:
        raise ConfigError("--record-worst", str(worst), "at least 0")
    if arguments.scenario is not None:
        raise ConfigError(
            "--scenario", repr(arguments.scenario), "the names of scenarios without an option"
        )
    if arguments.figure is not None:
        check_figure_file(arguments.figure)
    if arguments.report is not None:
        _check_only_report(arguments)
        out = arguments.report
    else:
        workers = read_workers(arguments, "scenarios")
        plan = _build_plan(arguments)
        out = arguments.out or make_run_dir(None)
        walk_campaign(plan, out, workers=workers, typed=arguments.typed, console=console)
    report = write_report(out, baseline=arguments.baseline, record_worst=worst, console=console)
    tables = [report.build_table(section) for section in ("success", "falls")]
    print_tables(table for table in tables if table is not None)
    print(out / PAGE)
    if arguments.figure is not None:
        write_figure(report, arguments.figure)
        print(arguments.figure)
    return 0


def _check_only_report(arguments: argparse.Namespace) -> None:
    given = {
        "scenarios": arguments.scenarios, "--planners": arguments.planners,
        "--predictors": arguments.predictors, "--variants": arguments.variants,
        "--seeds": arguments.seeds, "--sweep": arguments.sweep, "--dask": arguments.dask,
        "--bus": arguments.bus, "--out": arguments.out, "--config": arguments.config,
        **arguments.overrides,
    }  # fmt: skip
    for name, value in given.items():
        if value:
            shown = ", ".join(value) if isinstance(value, list) else value
            raise ConfigError("--report", f"{name} {shown}", "none: it walks nothing")


def _build_plan(arguments: argparse.Namespace) -> CampaignPlan:
    from quadriga.experiments.plan import build_plan
    from quadriga.experiments.seeds import parse_seeds
    from quadriga.experiments.sweep import parse_sweep
    from quadriga.experiments.variants import combine_with_predictors, parse_variants

    options = arguments.planners or ([] if arguments.variants else ["none,distributed"])
    predictors = [name.strip() for name in arguments.predictors.split(",") if name.strip()]
    seeds = SEEDS if arguments.seeds is None else arguments.seeds
    return build_plan(
        arguments.scenarios,
        combine_with_predictors(parse_variants(options, arguments.variants), predictors),
        tuple(map(parse_sweep, arguments.sweep)),
        parse_seeds("--seeds", seeds),
        arguments.baseline,
        arguments.config,
        arguments.overrides,
    )


def _parse_jobs(text: str) -> int:
    jobs = count_cores() if text == "auto" else int(text)
    if jobs < 1:
        raise argparse.ArgumentTypeError(f"got {jobs}, expected auto or at least 1")
    return jobs
