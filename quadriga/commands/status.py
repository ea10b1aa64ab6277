"""`quadriga status`: how a team is, once or again and again."""

from __future__ import annotations

import argparse
from typing import Final

from quadriga.commands.command import AddCommand, Given, check_options_beside
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.signals import stop_flag

_HEARD_S: Final = 2.0
_EVERY_S: Final = 1.0


def add(add_command: AddCommand) -> None:
    command = add_command(
        "status", run, "say how a team is, once or live: modes, rates, ages, times, losses"
    )
    command.epilog = "Exit status: 1 if anything is wrong; with --watch always 0."
    option = command.add_argument
    option("--watch", action="store_true", help="show it live, until the walk is over")
    option(
        "--every",
        type=float,
        metavar="S",
        help=f"with --watch: seconds between two looks ({_EVERY_S:g})",
    )
    option("-n", "--count", type=int, metavar="COUNT", help="with --watch: so many looks (endless)")
    option("--json", action="store_true", help="once, as JSON: see docs/status.md")
    option(
        "--seconds-heard",
        type=float,
        metavar="S",
        help=f"once, after listening for so long ({_HEARD_S:g})",
    )
    option(
        "--all",
        action="store_true",
        help="rates of states and commands too, which costs a good part of a core",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print how the team is; 1 if anything is wrong, unless it is shown again and again."""
    check_options_beside(
        "--watch",
        arguments.watch,
        needing={"--every": arguments.every, "--count": arguments.count},
        excluding={"--json": arguments.json, "--seconds-heard": arguments.seconds_heard},
    )
    return _watch(arguments, config) if arguments.watch else _look_once(arguments, config)


def _look_once(arguments: argparse.Namespace, config: Config) -> int:
    from quadriga.status.format import format_status, to_json
    from quadriga.status.listen import listening

    seconds = _HEARD_S if arguments.seconds_heard is None else arguments.seconds_heard
    if not 0.1 <= seconds <= 3600.0:
        raise ConfigError("--seconds-heard", f"{seconds:g}", "0.1 to 3600")
    with (
        stop_flag() as stopped,
        listening(config, "status", stopped, every_topic=arguments.all) as listener,
    ):
        listener.hear(0.5, stopped)  # until who is there is known
        listener.look()  # from here on processor times and rates count
        listener.hear(seconds, stopped)
        status = listener.look()
    print(to_json(status) if arguments.json else "\n".join(format_status(status)))
    return int(not status.is_well)


def _watch(arguments: argparse.Namespace, config: Config) -> int:
    """Show it until the walk is over, the count asked for, or a signal."""
    from rich.console import Console

    from quadriga.status.listen import listening
    from quadriga.status.screen import show_again_and_again

    every = _EVERY_S if arguments.every is None else arguments.every
    count = arguments.count or 0
    if count < 0 or not every >= 0.1:
        raise ConfigError("-n, --every", f"{count}, {every:g}", "at least 0 and 0.1 s")
    console = Console(highlight=False, soft_wrap=True)
    with (
        stop_flag() as stopped,
        listening(config, "status", stopped, every_topic=arguments.all) as listener,
    ):
        show_again_and_again(listener, console, stopped, every, count)
    return 0
