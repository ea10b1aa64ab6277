"""`quadriga resume`: the operator's word to go on."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("resume", run, "have robots walk again that stand because an input was lost")


def run(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print what each robot does then; 1 if some do not walk."""
    from quadriga.agents.modes import WALK
    from quadriga.shared.robot.conventions import robot_names
    from quadriga.team.resume import resume_team

    statuses = resume_team(config)
    for name in robot_names(config.team.robots):
        status = statuses.get(name)
        mode = "says nothing" if status is None else f"{status.mode} {status.reason}".rstrip()
        print(f"{name}: {mode}")
    return int(any(status.mode != WALK for status in statuses.values()) or not statuses)
