"""`quadriga fault`: a team in which one thing goes wrong, and the table of what came of it."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command("fault", run, "walk with a fault of a process, a sensor or a motor")
    option = command.add_argument
    option("names", nargs="*", metavar="FAULT", help="what goes wrong 1.5 to 4 s into each walk")
    option("--list", action="store_true", help="list all faults, and do not walk")
    option("--table", action="store_true", help="all faults, one after another")
    option("--tries", type=int, default=1, metavar="K", help="walks, of seeds world.seed on (1)")
    option("--json", type=Path, metavar="FILE", help="write all rows there")
    option("--out", type=Path, metavar="DIR", help="folder to write to (runs/<date>-<time>)")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Walk; 1 if a walk had no result, or another robot fell than the one with the fault."""
    import json

    from rich.console import Console

    from quadriga.faults.campaign import run_fault_campaign
    from quadriga.faults.catalogue import ALL, FAULTS, select_faults
    from quadriga.faults.table import build_team_fault_table
    from quadriga.shared.errors import name_file_errors
    from quadriga.tables import Table, print_tables
    from quadriga.team.run_folder import check_own_config, make_run_dir

    if arguments.list:
        meanings = tuple((fault.name, fault.what) for fault in FAULTS)
        print_tables([Table("Faults", ("fault", "what"), meanings)])
        return 0
    names = [ALL] if arguments.table else arguments.names
    if not names:
        raise ConfigError("fault", "none", "the name of a fault, or --table", "--list lists them")
    if arguments.tries < 1:
        raise ConfigError("--tries", str(arguments.tries), "at least 1")
    faults = select_faults(names)
    check_own_config(arguments.config, arguments.out)
    folder = make_run_dir(arguments.out)
    seeds = range(config.world.seed, config.world.seed + arguments.tries)
    console = Console()
    rows = run_fault_campaign(config, faults, seeds, folder, console)
    print_tables([build_team_fault_table(rows)])
    if arguments.json is not None:
        with name_file_errors(ConfigError, f"--json {arguments.json}", "a file to write to"):
            text = json.dumps(rows, indent=1, ensure_ascii=False)
            arguments.json.write_text(text + "\n", encoding="utf-8")
    console.print(f"folder: {folder}", markup=False, highlight=False)
    return int(any("error" in row or row["falls_of_others"] for row in rows))
