"""`quadriga fit`: a predictor, its gates and its report."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command(
        "fit", run, "fit the predictor, hold it against its gates and report on it"
    )
    command.add_argument(
        "--all",
        action="store_true",
        help="every predictor there is, on the same data, in one table",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Fit unless there is a predictor, and report on it; collect data unless there are some."""
    from rich.console import Console

    from quadriga.identification.fit_report import fit_and_report

    print(fit_and_report(config, Console(stderr=True), every=arguments.all))
    return 0
