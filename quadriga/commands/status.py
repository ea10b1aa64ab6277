"""`quadriga status`: how a team is, once."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.signals import stop_flag


def add(add_command: AddCommand) -> None:
    command = add_command("status", run, "say once how a team is; status 1 if anything is wrong")
    command.add_argument("--json", action="store_true", help="as JSON: see docs/status.md")
    command.add_argument(
        "--seconds-heard", type=float, default=2.0, metavar="S", help="listen for so long (2)"
    )
    add_every_topic(command)


def add_every_topic(command: argparse.ArgumentParser) -> None:
    """Whether to hear what is sent at 1 kHz."""
    command.add_argument(
        "--all",
        action="store_true",
        help="rates of states and commands too, which costs a good part of a core",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print how the team is; 1 if anything is wrong."""
    from quadriga.status.format import format_status, to_json
    from quadriga.status.listen import listening

    seconds = arguments.seconds_heard
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
