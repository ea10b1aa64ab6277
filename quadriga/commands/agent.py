"""`quadriga agent`: the process of one robot's agent."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.fitted_predictor import load_predictor
from quadriga.commands.options import add_predictor, add_wait
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import find_kind


def add(add_command: AddCommand) -> None:
    command = add_command("agent", run, "the agent of one robot")
    command.add_argument("--robot", required=True, metavar="NAME", help="r1 … rn")
    add_predictor(command)
    add_wait(command)


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Run the agent until the walk is over."""
    from quadriga.agents import process
    from quadriga.shared.robot.conventions import robot_names

    names = robot_names(config.team.robots)
    if arguments.robot not in names:
        raise ConfigError("--robot", repr(arguments.robot), f"one of {', '.join(names)}")
    predictor = None
    if find_kind(config.planner.kind).agents_predict:
        predictor = load_predictor(config, arguments)
    process.run(config, arguments.robot, predictor)
    return 0
