"""`quadriga check`: every message of a recording against the rules."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_file(add_command("check", run, "hold every message of a recording against the rules"))


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Print a line for each rule; 1 if one is broken."""
    from quadriga.recordings.check import check, format_findings

    findings = check(arguments.file)
    print("\n".join(format_findings(findings)))
    return int(not all(finding.passed for finding in findings))
