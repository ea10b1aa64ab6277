"""`quadriga scenarios`: what can be walked."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("scenarios", run, "list the scenarios that can be walked, and what they are")


def run(_arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
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
