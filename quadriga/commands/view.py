"""`quadriga view`: a team in the browser, while it walks or from a recording."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given, refuse_configuration
from quadriga.commands.options import recording_path
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.signals import stop_flag
from quadriga.view.port import HOST, PORT, PageAddress


def add(add_command: AddCommand) -> None:
    command = add_command("view", run, "show a team in the browser, live or from a recording")
    command.add_argument(
        "recording",
        nargs="?",
        type=recording_path,
        metavar="RUN",
        help="a recording or its run folder (without: the team on the bus)",
    )
    command.add_argument(
        "--port",
        type=int,
        default=PORT,
        metavar="PORT",
        help="of the page; 0: any that is free (%(default)s)",
    )
    command.add_argument(
        "--host",
        default=HOST,
        metavar="ADDRESS",
        help="of the page (%(default)s: this machine alone); whoever reaches another one sees the "
        "team, and can move what is played",
    )
    command.add_argument("--once", action="store_true", help="live: leave when the team has left")


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Show until a signal comes."""
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            "quadriga view",
            f"no package {error.name}",
            "the package viser",
            "install the project's dependencies with `make install`",
        ) from None
    from quadriga.view.live import view_live
    from quadriga.view.playback import view_recording

    address = PageAddress(arguments.port, arguments.host)
    with stop_flag() as stopped:
        if arguments.recording is None:
            view_live(config, address, stopped, _tell, once=arguments.once)
        else:
            refuse_configuration(given)
            if arguments.once:
                raise ConfigError("--once", "a recording, too", "a team on the bus, which leaves")
            view_recording(arguments.recording, address, stopped, _tell)
    return 0


def _tell(text: str) -> None:
    print(text, flush=True)
