"""`quadriga operate`: the operator's process."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("operate", run, "say how fast to walk where: as configured, or by hand")
    command.add_argument(
        "--view", metavar="URL", default="", help="of the picture in the page to drive from"
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Operate the team until the walk is over."""
    from quadriga.team import operator

    operator.run(config, view=arguments.view)
    return 0
