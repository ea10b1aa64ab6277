"""`quadriga info`: what a recording holds."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_file(add_command("info", run, "say what a recording holds"))


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Print what can be read of a recording, then complain if that is not all."""
    from quadriga.recordings.info import format_survey
    from quadriga.recordings.survey import survey

    result = survey(arguments.file)
    print("\n".join(format_survey(result)))
    if result.error is not None:
        raise result.error
    return 0
