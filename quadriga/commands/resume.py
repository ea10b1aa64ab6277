"""`quadriga resume`: the operator's word to go on."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("resume", run, "have robots walk again that stand after a loss or a stop")


def run(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print what each robot does then; 1 if some do not walk."""
    from quadriga.team.resume import resume_team

    walk, description = resume_team(config, say)
    print(description)
    return int(not walk)
