"""`quadriga config`: the configuration in force."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("config", run, "print the configuration in force as TOML")
    command.add_argument("--markdown", action="store_true", help="as documentation instead")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print it as TOML or Markdown."""
    from quadriga.shared.config.write import to_markdown, to_toml

    print(to_markdown(config) if arguments.markdown else to_toml(config), end="")
    return 0
