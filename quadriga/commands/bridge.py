"""`quadriga bridge`: the process that is the plant of one real robot."""

from __future__ import annotations

import argparse
from functools import partial

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.errors import ConfigError


def add(add_command: AddCommand) -> None:
    command = add_command("bridge", run, "the bridge to one real robot: a dry run, unless --armed")
    command.add_argument("--robot", required=True, metavar="NAME", help="r1 … rn")
    command.add_argument(
        "--armed", action="store_true", help="command the robot; without, no motor is enabled"
    )
    command.add_argument(
        "--test-joints",
        action="store_true",
        help="the robot hangs: move each joint a little, and judge it; without a team",
    )
    command.add_argument(
        "--restore",
        metavar="NAME",
        help="Go2: give the motors back to its own controller, such as normal; it may stand up",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Bridge the robot until the walk is over."""
    from quadriga.bridges.plant import build_bridge
    from quadriga.plant import process
    from quadriga.shared.robots.conventions import robot_names
    from quadriga.shared.runtime.signals import stop_on_signals

    team, names = config.team, robot_names(config.team.robots)
    if arguments.robot not in names:
        raise ConfigError("--robot", repr(arguments.robot), f"one of {', '.join(names)}")
    if team.plant != BRIDGED:
        raise ConfigError("team.plant", repr(team.plant), repr(BRIDGED), "whose robots are these?")
    for name, given, cause in (
        ("--test-joints", arguments.test_joints, "it moves the joints: hang the robot up first"),
        ("--restore", arguments.restore, "the robot may stand up: keep away from it"),
    ):
        if given and not arguments.armed:
            raise ConfigError(name, "no --armed", "--armed with it", cause)
    if arguments.restore:
        return _restore(config, arguments.robot, arguments.restore)
    if arguments.test_joints:
        return _test_joints(config, arguments.robot)
    stopped = stop_on_signals()
    build = partial(build_bridge, armed=arguments.armed, stopped=stopped)
    process.run(config, build, arguments.robot, stopped)
    return 0


def _restore(config: Config, name: str, controller: str) -> int:
    from quadriga.bridges.drivers import Go2Driver

    if config.team.robot != "go2":
        cause = "A1 and Go1: switch it off and on again"
        raise ConfigError("--restore", f"a team of {config.robot.title}", "of Go2", cause)
    driver = Go2Driver(config.bridge.of_robot(name))
    try:
        driver.give_back(controller)
    finally:
        driver.close()
    say(f"robot {name}: its own controller {controller!r} has the motors")
    return 0


def _test_joints(config: Config, name: str) -> int:
    from quadriga.bridges.joint_test import build_joint_tester, refuse_wrong, table
    from quadriga.shared.runtime.scheduling import end_collection, take_priority
    from quadriga.shared.runtime.signals import stop_on_signals

    stopped = stop_on_signals()
    tester = build_joint_tester(config, name)
    end_collection()
    take_priority(config.runtime.priority)
    verdicts = tester.run(stopped)
    print(table(verdicts))
    tester.refuse_stopped()
    if stopped():
        raise KeyboardInterrupt
    refuse_wrong(name, verdicts)
    return 0
