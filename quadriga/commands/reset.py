"""`quadriga reset`: the operator releases an emergency stop."""

from __future__ import annotations

import argparse
import getpass

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("reset", run, "release an emergency stop: robots get up and walk on")
    command.add_argument(
        "--by", metavar="NAME", help="who releases it, told to all [who is logged in]"
    )
    command.add_argument(
        "--stand", action="store_true", help="only get up and stand, until `quadriga resume`"
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print what each robot does then; 1 if some do not do what was asked."""
    from quadriga.team.reset import reset_team

    by = arguments.by or _logged_in()
    done, description = reset_team(config, by, stand=arguments.stand, tell=say)
    print(description)
    return int(not done)


def _logged_in() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a container's user may have no name
        return "operator"
