"""`quadriga probe`: the true response to pulses, and predictors held against it."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command(
        "probe", run, "measure the team's true response to a pulse, and hold predictors against it"
    )
    option = command.add_argument
    option(
        "--predictors",
        default="",
        metavar="LIST",
        help="these instead of the configured one, separated by commas; as in a campaign",
    )
    option(
        "--predictor",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="the predictor in this file instead of the configured one; may be repeated",
    )
    option(
        "--repetitions",
        type=int,
        default=2,
        metavar="K",
        help="worlds to measure in, of as many seeds from world.seed on (2)",
    )
    option("--jobs", type=int, metavar="N", help="walks side by side (one for each core)")
    option("--out", type=Path, metavar="DIR", help="folder to write to (runs/<date>-<time>)")


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Measure what is not known yet, compare, and write it down."""
    from rich.console import Console

    from quadriga.experiments.probe.probe import PAGE, probe, write_outcome
    from quadriga.experiments.probe.probe_tables import build_overall
    from quadriga.experiments.probe.probed import (
        configured_predictor,
        named_predictors,
        predictor_of_file,
    )
    from quadriga.tables import print_tables
    from quadriga.team.run_folder import make_run_dir

    jobs = len(os.sched_getaffinity(0)) if arguments.jobs is None else arguments.jobs
    for option, number in (("--repetitions", arguments.repetitions), ("--jobs", jobs)):
        if number < 1:
            raise ConfigError(option, str(number), "at least 1")
    console = Console(stderr=True)
    names = [name.strip() for name in arguments.predictors.split(",") if name.strip()]
    probed = named_predictors(names, given, console)
    probed += [predictor_of_file(path, config) for path in arguments.predictor]
    if not probed:
        probed = [configured_predictor(config, console)]
    folder = make_run_dir(arguments.out)
    outcome = probe(config, probed, arguments.repetitions, jobs, console)
    write_outcome(outcome, folder)
    print_tables([build_overall(outcome)])
    print(folder / PAGE)
    return 0
