"""`quadriga estop`: the emergency stop."""

from __future__ import annotations

import argparse
from typing import Final

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config

_NOT_STOPPED: Final = 1
_STDIN: Final = 0


def add(add_command: AddCommand) -> None:
    command = add_command("estop", run, "stop the team at once: every joint is damped")
    command.add_argument("--reason", default="operator", help="told to every agent")
    command.add_argument(
        "--armed",
        action="store_true",
        help="wait for the Enter key, linked to the team: then the stop takes milliseconds",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Send one emergency stop to every robot; armed, when Enter is pressed."""
    from quadriga.team.emergency_stop import stop_team, wait_and_stop

    if not arguments.armed:
        stop_team(config, arguments.reason, lambda text: print(text, flush=True), say)
        return 0
    if wait_and_stop(config, arguments.reason, _STDIN, say):
        return 0
    say("not stopped: the keyboard is gone")
    return _NOT_STOPPED
