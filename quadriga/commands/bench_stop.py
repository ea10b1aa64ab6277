"""`quadriga bench-stop`: how long it takes until a team has stopped."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.atomic import write_text


def add(add_command: AddCommand) -> None:
    command = add_command(
        "bench-stop", run, "stop a team that is driven again and again, in each way, and time it"
    )
    option = command.add_argument
    option("ways", nargs="*", metavar="WAY", help="page keyboard estop armed gamepad silence (all)")
    option("--tries", type=int, default=100, metavar="K", help="of each way (%(default)s)")
    option("--json", type=Path, metavar="FILE", help="write the figures of each way there")
    option("--out", type=Path, metavar="DIR", help="folder to write to (runs/<date>-<time>)")


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Walk in real time and stop; 1 if a team did not stop."""
    import json

    from rich.console import Console

    from quadriga.shared.errors import name_file_errors
    from quadriga.stop_times.bench import time_stops
    from quadriga.stop_times.figures import build_stop_table, sum_up
    from quadriga.stop_times.ways import WAYS
    from quadriga.tables import print_tables
    from quadriga.team.run_folder import make_run_dir

    ways = arguments.ways or [*WAYS]
    for way in ways:
        if way not in WAYS:
            raise ConfigError("way", repr(way), f"one of {', '.join(WAYS)}")
    if arguments.tries < 1:
        raise ConfigError("--tries", str(arguments.tries), "at least 1")
    if not config.team.one_world:
        raise ConfigError("team.plant", repr(config.team.plant), "one simulated world")
    if "mode" not in given.get("world", {}):
        config = replace(config, world=replace(config.world, mode="realtime"))
    console = Console()
    folder = make_run_dir(arguments.out)
    rows = time_stops(config, ways, arguments.tries, folder, console)
    figures = sum_up({w: [row["ms"] for row in rows if row["way"] == w] for w in ways})
    print_tables([build_stop_table(figures)])
    if arguments.json is not None:
        with name_file_errors(ConfigError, f"--json {arguments.json}", "a file to write to"):
            write_text(arguments.json, json.dumps(figures, indent=1) + "\n")
    console.print(f"folder: {folder}", markup=False, highlight=False)
    return int(any(row["stopped"] < row["tries"] for row in figures.values()))
