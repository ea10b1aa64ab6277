"""`quadriga walk`: the main job."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_no_render
from quadriga.shared.config.sections import BRIDGED, BY_HAND, Config
from quadriga.shared.errors import ConfigError

if TYPE_CHECKING:
    from quadriga.team.walk import Report

_DRIVEN_SECONDS: Final = 3600.0


def add(add_command: AddCommand) -> None:
    command = add_command("walk", run, "start all processes, walk, and show what came of it")
    command.add_argument(
        "--list", action="store_true", help="list the scenarios that can be walked, and do not walk"
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="run folder (runs/<date>-<time>)")
    command.add_argument(
        "--armed",
        action="store_true",
        help="bridges command their robots (team.plant 'robots'); without, no motor is enabled",
    )
    command.add_argument(
        "--drive",
        action="store_true",
        help="by hand, from a page whose URL is printed, or by `quadriga drive`: in real time and "
        "for an hour, unless said otherwise",
    )
    show = command.add_mutually_exclusive_group()
    show.add_argument(
        "--view",
        type=int,
        nargs="?",
        const=0,
        metavar="PORT",
        help="show the walk in the browser, at this port (8090, or any that is free); so it is "
        "without the option in a terminal with a display",
    )
    show.add_argument("--no-view", action="store_true", help="do not show it there")
    add_no_render(command)
    command.add_argument(
        "--no-report",
        action="store_true",
        help="no figures and no page of the walk; `quadriga report` makes them of its recording",
    )


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Walk once; 0 if all walked to the end, 1 if one fell or stopped, 130 if interrupted."""
    from rich.console import Console

    from quadriga.team.endpoint import with_free_endpoint
    from quadriga.team.walk import walk
    from quadriga.view.port import choose_port, is_at_display

    if arguments.list:
        return _list_scenarios()
    config = with_free_endpoint(config, given)
    if arguments.drive:
        config = _driven(config, given)
    if arguments.armed and config.team.plant != BRIDGED:
        plant = config.team.plant
        raise ConfigError("--armed", f"with team.plant {plant!r}", f"team.plant {BRIDGED!r}")
    return walk(
        config,
        arguments.out,
        report=_report(arguments),
        console=Console(),
        armed=arguments.armed,
        view=choose_port(arguments.view, wanted=not arguments.no_view and is_at_display()),
    )


def _list_scenarios() -> int:
    """Print a table of names and descriptions."""
    from rich.console import Console
    from rich.table import Table

    from quadriga.team.scenarios import description, names

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, style="bold")
    table.add_column()
    for name in names():
        table.add_row(name, description(name))
    Console().print(table)
    return 0


def _report(arguments: argparse.Namespace) -> Report:
    from quadriga.team.walk import Report

    if arguments.no_report:
        return Report.TABLE
    return Report.PAGE if arguments.no_render else Report.PICTURES


def _driven(config: Config, given: Given) -> Config:
    """The configuration of a team that is driven by hand."""
    world = {"mode": "realtime", "duration": _DRIVEN_SECONDS}
    changes: dict[str, Any] = {
        name: value for name, value in world.items() if name not in given.get("world", {})
    }
    return replace(
        config,
        world=replace(config.world, **changes),
        reference=replace(config.reference, driver=BY_HAND),
    )
