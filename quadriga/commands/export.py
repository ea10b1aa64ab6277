"""`quadriga export`: a recording in a format of others."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("export", run, "convert a recording for other tools")
    add_file(command)
    command.add_argument(
        "--to",
        required=True,
        choices=("foxglove", "rerun", "csv", "parquet"),
        help="MCAP for Foxglove, RRD for Rerun, or one table per key",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="OUT", help="a new file or folder (beside FILE)"
    )


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Convert a recording, a cut one as far as it goes."""
    from rich.console import Console

    from quadriga.export import run as exporter
    from quadriga.shared.recording.reader import Recording

    exporter.run(arguments.file, arguments.to, arguments.output, Console())
    Recording(arguments.file).require_whole()
    return 0
