"""`quadriga agent`: the process of one robot's agent."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import NoReturn

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
    """Run the agent until the walk is over, or become the controller in its place."""
    from quadriga.shared.robots.conventions import robot_names

    names = robot_names(config.team.robots)
    if arguments.robot not in names:
        raise ConfigError("--robot", repr(arguments.robot), f"one of {', '.join(names)}")
    if config.team.agent_command:
        _become_controller(arguments, config)
    from quadriga.agents import process  # compiled code, which a controller does not wait for
    from quadriga.identification.central_planner import collected_of

    predictor = None
    if find_kind(config.planner.kind).agents_predict:
        predictor = load_predictor(config, arguments)
    process.run(config, arguments.robot, predictor, collected=collected_of(config))
    return 0


def _become_controller(arguments: argparse.Namespace, config: Config) -> NoReturn:
    """Go on as the controller of one's own that the configuration names."""
    from quadriga.shared.config.write import to_toml
    from quadriga.team.controller_program import become_controller, places_of

    file: Path | None = arguments.config
    if file is None or arguments.overrides or arguments.scenario is not None:
        file = Path(tempfile.mkdtemp(prefix="quadriga-"), "config.toml")
        file.write_text(to_toml(config), encoding="utf-8")
    become_controller(config, places_of(config, arguments.robot, file))
