"""`quadriga sim`: the sim server's process."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("sim", run, "the sim server alone")


def run(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Run the sim server until the walk is over."""
    from quadriga.sim_server import process

    process.run(config)
    return 0
