"""`quadriga version`: the installed version."""

from __future__ import annotations

import argparse
from typing import Any

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("version", run, "print the version, as `quadriga --version` does")


def run(_arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Print the version."""
    print(describe_version())
    return 0


def describe_version() -> str:
    """The installed version in a line."""
    from quadriga.shared.runtime.installed import project_version

    version = project_version()
    return f"quadriga {version}" if version else "quadriga, from a folder that is not installed"


class ShowVersion(argparse.Action):
    """The option that prints the version; to look it up takes 20 ms, so only then."""

    def __init__(self, **named: Any) -> None:
        super().__init__(nargs=0, **named)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it and end."""
        print(describe_version())
        parser.exit()
