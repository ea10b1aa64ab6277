"""`quadriga resim`: the world of a recording once more, compared to the byte."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("resim", run, "re-simulate a recorded world and compare it to the byte")
    add_file(command, "of a lock-step walk")


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Recompute the world; 1 if something differs."""
    from rich.console import Console

    from quadriga.replay.resim import compare_world
    from quadriga.shared.recording.reader import Recording

    equal = compare_world(arguments.file, Console())
    Recording(arguments.file).require_whole()
    return int(not equal)
