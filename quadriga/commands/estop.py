"""`quadriga estop`: the emergency stop."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("estop", run, "stop the team at once: every joint is damped")
    command.add_argument("--reason", default="operator", help="told to every agent")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Send one emergency stop to every robot."""
    from quadriga.team.operator import stop_team

    stop_team(config, arguments.reason)
    return 0
