"""`quadriga sim`: the process of the team's plant, or of one robot's."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command("sim", run, "the sim server alone, or another plant")
    command.add_argument(
        "--robot",
        default="",
        metavar="NAME",
        help="the plant of this robot alone, where team.plant_per_robot is true",
    )
    command.add_argument(
        "--as",
        dest="emulated",
        default="",
        choices=("a1", "go1", "go2"),
        help="the simulated robots speak the protocol of this kind, for bridges, and lie at first",
    )
    command.add_argument(
        "--hung",
        action="store_true",
        help="with --as: the robots hang in the air, for a test of their joints",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Run the plant until the walk is over."""
    from quadriga.plant import process
    from quadriga.shared.robots.conventions import robot_names
    from quadriga.team.plants import plant_factory

    if arguments.emulated:
        return _emulate(arguments, config)
    if arguments.hung:
        raise ConfigError("--hung", "no --as", "--as with a kind of robot")
    robot, own = arguments.robot, config.team.plant_per_robot
    permitted = robot_names(config.team.robots) if own else ("",)
    if robot not in permitted:
        expected = f"one of {', '.join(permitted)}" if own else "nothing"
        cause = f"team.plant_per_robot is {str(own).lower()}"
        raise ConfigError("--robot", repr(robot), expected, cause)
    process.run(config, plant_factory(config), robot)
    return 0


def _emulate(arguments: argparse.Namespace, config: Config) -> int:
    from quadriga.sim_server import emulator

    kind = arguments.emulated
    if kind != config.team.robot:
        cause = "team.robot says what the team is made of"
        raise ConfigError("--as", repr(kind), repr(config.team.robot), cause)
    emulator.run(config, hung=arguments.hung)
    return 0
