"""`quadriga compare`: planners and predictors in the same worlds, on the same data."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    """The command and its options."""
    command = add_command("compare", run, "compare planners and predictors in the same worlds")
    for option, default, doc in (
        ("planners", "none,decentralised,distributed,centralised", "planners"),
        ("predictors", "ridge,pinv,causal,arx", "predictors"),
        ("scenarios", "flat", "worlds"),
        ("seeds", "0:3", "seeds of the worlds: 0:3 is 0, 1, 2; 1,5 is both"),
    ):
        named = "" if option == "seeds" else "; '?' lists the names"
        command.add_argument(
            f"--{option}",
            default=default,
            metavar="LIST",
            help=f"{doc}, separated by commas{named} ({default})",
        )
    command.add_argument(
        "--product", action="store_true", help="every planner with every predictor"
    )
    command.add_argument(
        "--jobs",
        type=int,
        default=os.cpu_count() or 1,
        metavar="N",
        help="walks side by side (%(default)s)",
    )
    command.add_argument(
        "--bus", action="store_true", help="each walk as processes of its own, one after the other"
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="folder (runs/<date>-<time>)")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Walk every choice in the same worlds, on the same data."""
    from rich.console import Console

    from quadriga.experiments import compare
    from quadriga.experiments.trial.trials import Choice
    from quadriga.experiments.trial.variants import (
        PLANNERS,
        PREDICTORS,
        SCENARIOS,
        chosen,
        seeds_of,
    )
    from quadriga.team.run_folder import check_own_config, make_run_dir

    if arguments.jobs < 1:
        raise ConfigError("--jobs", str(arguments.jobs), "at least 1")
    choice = Choice(
        chosen("--planners", arguments.planners, PLANNERS),
        chosen("--predictors", arguments.predictors, PREDICTORS),
        chosen("--scenarios", arguments.scenarios, SCENARIOS),
        seeds_of("--seeds", arguments.seeds),
        arguments.product,
    )
    check_own_config(arguments.config, arguments.out)
    out = arguments.out or make_run_dir(None)
    compare.run(
        config, choice, out, jobs=arguments.jobs, bus=arguments.bus, console=Console(stderr=True)
    )
    return 0
