"""`quadriga router`: the router's process."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("router", run, "the router between processes in client mode")
    command.add_argument("--listen", metavar="ENDPOINT", help="where (bus.endpoint)")
    command.add_argument("--once", action="store_true", help="leave when the team has walked")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Route until a signal comes or, with `--once`, until one walk is over."""
    from quadriga.team import router

    listen = arguments.listen or config.bus.endpoint
    router.run(config, listen, once=arguments.once)
    return 0
