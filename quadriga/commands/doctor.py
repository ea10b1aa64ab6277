"""`quadriga doctor`: why processes of a team are not there, and what this computer lacks."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command(
        "doctor", run, "say why a process of the team is not there, and what this computer lacks"
    )
    command.add_argument("--here", action="store_true", help="this computer alone, not the team")
    command.add_argument("--json", action="store_true", help="as JSON: see docs/doctor.md")
    command.add_argument(
        "--watch",
        type=Path,
        metavar="DIR",
        help="look again and again until the walk is over, and write into the file DIR/NAME "
        "whether process NAME is healthy",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print what was found; 1 if something is wrong. With `--watch` write it down, and 0."""
    if arguments.watch is not None:
        from quadriga.doctor.watch_team import watch_team

        if arguments.here or arguments.json:
            raise ConfigError("--watch", "--here or --json beside it", "one of them")
        watch_team(config, arguments.watch)
        return 0
    from quadriga.doctor.examine import examine
    from quadriga.doctor.report import format_report, to_json

    report = examine(config, here=arguments.here)
    print(to_json(report) if arguments.json else "\n".join(format_report(report)))
    return int(not report.is_well)
