"""`quadriga desk`: simulated robots behind their own protocols and the team, on this machine."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command(
        "desk", run, "walk simulated robots through bridges and their own protocols, with faults"
    )
    option = command.add_argument
    option(
        "--fault",
        action="append",
        default=[],
        metavar="NAME",
        help="what goes wrong 2 to 4 s into each walk, or 'all'; may be repeated",
    )
    option("--tries", type=int, default=1, metavar="K", help="walks, of seeds world.seed on (1)")
    option("--compare", action="store_true", help="walk each seed without bridges, too")
    option("--out", type=Path, metavar="DIR", help="folder to write to (runs/<date>-<time>)")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Walk; 1 if there was no walk, or a robot fell that nothing was done to."""
    from rich.console import Console

    from quadriga.desk.campaign import has_failed, named_faults, run_campaign
    from quadriga.desk.tables import build_fault_table, build_walk_table
    from quadriga.tables import print_tables
    from quadriga.team.run_folder import make_run_dir

    if config.team.plant != BRIDGED:
        cause = "deploy/desk.toml is a configuration for this"
        raise ConfigError("team.plant", repr(config.team.plant), repr(BRIDGED), cause)
    if arguments.tries < 1:
        raise ConfigError("--tries", str(arguments.tries), "at least 1")
    faults = named_faults(arguments.fault)
    folder = make_run_dir(arguments.out)
    first = config.world.seed
    console = Console()
    rows = run_campaign(
        config,
        faults,
        range(first, first + arguments.tries),
        folder,
        console,
        compare=arguments.compare,
    )
    print_tables(t for t in (build_walk_table(rows), build_fault_table(rows)) if t.rows)
    console.print(f"folder: {folder}", markup=False, highlight=False)
    return int(any(map(has_failed, rows)))
