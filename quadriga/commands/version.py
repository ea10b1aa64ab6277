"""`quadriga version`: the installed version."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("version", run, "print the version")


def run(_arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Print the version."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed_version

    try:
        print(f"quadriga {installed_version('quadriga')}")
    except PackageNotFoundError:
        print("quadriga, from a source folder that is not installed")
    return 0
