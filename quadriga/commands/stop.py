"""`quadriga stop`: the team slows down and stands, and the walk is over."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("stop", run, "have the team slow down and stand, and end the walk")
    command.add_argument("--reason", default="operator", help="told to every agent")
    command.add_argument(
        "--stand", action="store_true", help="only stand, until `quadriga resume`; the walk goes on"
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print what each robot does then; 1 if some do not stand or the walk is not over."""
    from quadriga.team.safe_stop import stop_safely

    ends = not arguments.stand
    done, description = stop_safely(config, arguments.reason, ends=ends, tell=say)
    print(description)
    return int(not done)
