"""`quadriga top`: how a team is, live."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.status import add_every_topic
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.signals import stop_flag


def add(add_command: AddCommand) -> None:
    command = add_command("top", run, "show live how a team is: modes, rates, ages, times, losses")
    option = command.add_argument
    option("--every", type=float, default=1.0, metavar="S", help="seconds between two looks (1)")
    option("-n", "--count", type=int, default=0, metavar="COUNT", help="stop after so many looks")
    add_every_topic(command)


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Show it until the walk is over, the count asked for, or a signal."""
    from rich.console import Console

    from quadriga.status.listen import listening
    from quadriga.status.screen import show_again_and_again

    every, count = arguments.every, arguments.count
    if count < 0 or not every >= 0.1:
        raise ConfigError("-n, --every", f"{count}, {every:g}", "at least 0 and 0.1 s")
    console = Console(highlight=False, soft_wrap=True)
    with (
        stop_flag() as stopped,
        listening(config, "top", stopped, every_topic=arguments.all) as listener,
    ):
        show_again_and_again(listener, console, stopped, every, count)
    return 0
