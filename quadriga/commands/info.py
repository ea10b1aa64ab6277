"""`quadriga info`: what a recording holds, and whether it is what it should be."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("info", run, "say what a recording holds, or check it")
    add_file(command)
    command.add_argument(
        "--check",
        action="store_true",
        help="instead hold every message against the rules; exit status 1 if one is broken",
    )


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Print what can be read of a recording, then complain if that is not all; or check it."""
    from quadriga.recordings.info import format_survey
    from quadriga.recordings.survey import survey

    if arguments.check:
        return _check(arguments)
    result = survey(arguments.file)
    print("\n".join(format_survey(result)))
    if result.error is not None:
        raise result.error
    return 0


def _check(arguments: argparse.Namespace) -> int:
    """Print a line for each rule; 1 if one is broken."""
    from quadriga.recordings.check import check, format_findings

    findings = check(arguments.file)
    print("\n".join(format_findings(findings)))
    return int(not all(finding.passed for finding in findings))
