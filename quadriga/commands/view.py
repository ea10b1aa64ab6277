"""`quadriga view`: a team in the browser, while it walks or from a recording."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given, refuse_configuration
from quadriga.commands.options import recording_path
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.signals import stop_flag
from quadriga.view.port import PORT


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
        help="of the page, on this machine alone; 0: any that is free (%(default)s)",
    )


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

    with stop_flag() as stopped:
        if arguments.recording is None:
            view_live(config, arguments.port, stopped, _tell)
        else:
            refuse_configuration(given)
            view_recording(arguments.recording, arguments.port, stopped, _tell)
    return 0


def _tell(text: str) -> None:
    print(text, flush=True)
