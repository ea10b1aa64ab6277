"""`quadriga drive`: drive a team that is driven by hand."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config

_GAMEPAD: Final = Path("/dev/input/js0")


def add(add_command: AddCommand) -> None:
    command = add_command("drive", run, "drive a team on this machine that is driven by hand")
    how = command.add_mutually_exclusive_group()
    how.add_argument("--keyboard", action="store_true", help="by the keys of this terminal")
    how.add_argument(
        "--gamepad",
        nargs="?",
        type=Path,
        const=_GAMEPAD,
        metavar="DEVICE",
        help=f"by a gamepad of this machine ({_GAMEPAD})",
    )


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Say where the page to drive from is, or drive by keys or a gamepad."""
    from quadriga.drive.driver_words import WHERE
    from quadriga.drive.drivers import drive_by_gamepad, drive_by_keys
    from quadriga.drive.find import open_link
    from quadriga.drive.wish import standing
    from quadriga.shared.runtime.signals import stop_on_signals

    name = config.team.name if "name" in given.get("team", {}) else ""
    with open_link(name) as link:
        if arguments.keyboard:
            drive_by_keys(link, standing(config), stop_on_signals(), say)
        elif arguments.gamepad is not None:
            drive_by_gamepad(link, arguments.gamepad, standing(config), stop_on_signals(), say)
        else:
            url = link.ask(WHERE).get("url")
            print(url or "this team is not driven by hand: quadriga walk --drive")
            return int(not url)
    return 0
