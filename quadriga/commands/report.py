"""`quadriga report`: what came of a recorded walk."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_no_render
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command("report", run, "show what came of a recorded walk")
    command.add_argument(
        "run", type=Path, metavar="FILE|DIR", help="a recording, or the folder of a run.mcap"
    )
    command.add_argument(
        "--html",
        type=Path,
        metavar="FILE",
        help="the page of a recording's FILE (its name with .html)",
    )
    add_no_render(command)


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Report on a file or a run folder; 1 if a robot fell or stopped for a reason of its own."""
    from rich.console import Console

    from quadriga.shared.recording.reader import Recording
    from quadriga.team.run_report import report_file, report_folder
    from quadriga.team.run_summary import has_failed

    html, pictures = arguments.html, not arguments.no_render
    if html is not None and html.suffix.lower() not in (".html", ".htm"):
        raise ConfigError(
            "--html", str(html), "a name that ends in .html", "a recording is never written over"
        )
    if arguments.run.is_file():
        summary = report_file(arguments.run, html, pictures=pictures, console=Console())
        Recording(arguments.run).require_whole()
    elif html is not None:
        raise ConfigError(
            "--html",
            str(html),
            "a recording's FILE before it",
            "a run folder's page is its report.html",
        )
    else:
        summary = report_folder(arguments.run, pictures=pictures, console=Console())
    return int(has_failed(summary))
