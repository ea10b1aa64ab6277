"""`quadriga fault`: a team in which one thing goes wrong, and the table of what came of it."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.atomic import write_text

_SHORTEST_S: Final = 0.5  # of a walk, as far as its own fault asks for no more


def add(add_command: AddCommand) -> None:
    command = add_command(
        "fault", run, "walk with a fault of a process, a link, a sensor or a motor"
    )
    option = command.add_argument
    option(
        "names",
        nargs="*",
        metavar="FAULT",
        help="what goes wrong 1.5 to 4 s into each walk; with --at also [ROBOT/]PART KIND",
    )
    option(
        "--at",
        type=float,
        metavar="S",
        help="with a name, r2/imu stuck, r2/agent killed or operator frozen: when, in world time",
    )
    option("--for", type=float, dest="span", metavar="S", help="for how long (until the end)")
    option(
        "--live",
        action="store_true",
        help="in the team that walks now, if it has world.live_faults: ROBOT/COMPONENT KIND",
    )
    option("--list", action="store_true", help="list all faults, and do not walk")
    option("--table", action="store_true", help="all faults, one after another")
    option("--tries", type=int, default=1, metavar="K", help="walks, of seeds world.seed on (1)")
    option(
        "--jobs",
        type=int,
        default=1,
        metavar="K",
        help="teams that walk side by side in lock-step (1); in real time each walks alone",
    )
    option("--json", type=Path, metavar="FILE", help="write all rows there")
    option("--out", type=Path, metavar="DIR", help="folder to write to (runs/<date>-<time>)")


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Walk; 1 if a walk had no result, or another robot fell than the one with the fault."""
    import json

    from rich.console import Console

    from quadriga.faults.campaign import run_fault_campaign
    from quadriga.faults.catalogue import ALL, build_meaning_tables, select_faults
    from quadriga.faults.table import build_team_fault_tables
    from quadriga.shared.errors import name_file_errors
    from quadriga.tables import print_tables
    from quadriga.team.run_folder import make_run_dir

    if arguments.list:
        print_tables(build_meaning_tables())
        return 0
    if arguments.live:
        return _ask(arguments, config)
    names = [ALL] if arguments.table else _names_of(arguments)
    if not names:
        raise ConfigError("fault", "none", "the name of a fault, or --table", "--list lists them")
    for name in ("tries", "jobs"):
        if getattr(arguments, name) < 1:
            raise ConfigError(f"--{name}", str(getattr(arguments, name)), "at least 1")
    if "duration" not in given.get("world", {}):  # then a walk lasts no longer than its fault needs
        config = replace(config, world=replace(config.world, duration=_SHORTEST_S))
    faults = select_faults(names, config)
    folder = make_run_dir(arguments.out)
    seeds = range(config.world.seed, config.world.seed + arguments.tries)
    console = Console()
    rows = run_fault_campaign(config, faults, seeds, folder, console, arguments.jobs)
    print_tables(build_team_fault_tables(rows))
    if arguments.json is not None:
        with name_file_errors(ConfigError, f"--json {arguments.json}", "a file to write to"):
            text = json.dumps(rows, indent=1, ensure_ascii=False)
            write_text(arguments.json, text + "\n")
    console.print(f"folder: {folder}", markup=False, highlight=False)
    return int(any("error" in row or row["falls_of_others"] for row in rows))


def _ask(arguments: argparse.Namespace, config: Config) -> int:
    """Ask for a fault in a team that walks; 0 once the world has said that it comes."""
    from quadriga.team.live_fault import ask_for_fault

    if arguments.at is not None:
        raise ConfigError("--at", f"{arguments.at:g} with --live", "--for alone", "it is now")
    words = [*arguments.names, *([] if arguments.span is None else [f"{arguments.span:g}"])]
    event = ask_for_fault(config, " ".join(words))
    print(printable_line(f"{1e-3 * event.tick:.3f} s: {event.detail}"))
    return 0


def _names_of(arguments: argparse.Namespace) -> list[str]:
    """The faults asked for; the words of one with --at are one, as `find_given_fault` has it.

    Raises:
        ConfigError: a robot, a process or --for without --at, or --at without a fault.
    """
    from quadriga.faults.catalogue import BY_NAME
    from quadriga.faults.given import GRAMMAR

    names: list[str] = arguments.names
    given, timed = any("/" in name for name in names), arguments.at is not None
    if not given and not timed and arguments.span is None:
        return names
    if not (names and timed):
        raise ConfigError("fault", " ".join(names) or "none", GRAMMAR, "docs/how/safety.md")
    times = [f"{arguments.at:g}", *([] if arguments.span is None else [f"{arguments.span:g}"])]
    if all(name in BY_NAME for name in names):
        return [" ".join([name, *times]) for name in names]
    return [" ".join([*names, *times])]
