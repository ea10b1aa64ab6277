"""`quadriga tune`: numbers of the configuration, searched by walking."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.campaign import add_workers, read_workers
from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("tune", run, "search for better gains and weights by walking")
    command.epilog = (
        "The same command goes on where it ended. `judged` in the folder is a campaign of the "
        "result beside the start, on seeds that the search did not walk."
    )
    option = command.add_argument
    option(
        "file", type=Path, metavar="FILE", help="TOML: what is tuned, where, with how many walks"
    )
    add_workers(command)
    option(
        "--out", type=Path, metavar="DIR", help="folder, new or to go on with (runs/tune/<FILE>)"
    )


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Walk what is missing of a search, then report on its result."""
    from rich.console import Console

    from quadriga.experiments.campaign.write_report import write_report
    from quadriga.experiments.tuning.search import JUDGED, START, VARIANTS, search
    from quadriga.experiments.tuning.tuning_file import read_tuning
    from quadriga.tables import print_tables

    console = Console(stderr=True)
    tuning = read_tuning(arguments.file)
    out = arguments.out or Path("runs/tune") / arguments.file.stem
    workers = read_workers(arguments, "FILE")
    search(tuning, out, workers=workers, typed=arguments.typed, console=console)
    report = write_report(out / JUDGED, baseline=START, record_worst=0, console=console)
    tables = [report.build_table(section) for section in ("success", "falls", "errors")]
    print_tables(table for table in tables if table is not None)
    print(out / VARIANTS)
    return 0
