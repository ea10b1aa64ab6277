"""`quadriga operate`: the operator's process."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("operate", run, "publish the velocity reference of the configuration")


def run(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Operate the team until the walk is over."""
    from quadriga.team import operator

    operator.run(config)
    return 0
