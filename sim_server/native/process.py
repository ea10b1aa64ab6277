"""SHELL of the simulated team that speaks the robots' own protocols, in real time."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import replace

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.runtime.collector import end_collection
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.unitree.udp import CODECS
from quadriga.shared.unitree.udp_port import Address, parse_address
from quadriga.shared.wire.codes import FALL
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.native.board import Board
from quadriga.sim_server.native.go2_robot import Go2Robot
from quadriga.sim_server.native.hanger import Hanger
from quadriga.sim_server.native.udp_robot import UdpRobot
from quadriga.sim_server.world.world import World

OFF, DAMPED, DRIVEN = "motors off", "motors damped", "motors driven"
_TICK = 1e-3  # s


def run(config: Config, stopped: Callable[[], bool] | None = None, *, hung: bool = False) -> None:
    """Be the robots until told to stop. They lie on the ground at first, or hang.

    Args:
        config: the team's configuration; `bridge.endpoint` and `bridge.listen` say where each robot
            is, and where its reports go.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.
        hung: whether the robots hang in the air.

    Raises:
        ConfigError: an address does not parse or is missing, or this kind has no protocol here.
        BridgeError: a port is taken.
    """
    stopped = stopped or stop_on_signals()
    world = World(replace(config, world=replace(config.world, spawn="lying")))
    hanger = Hanger(world)
    if hung:
        hanger.spawn_hung()
    robots = open_robots(config)
    try:
        _serve(world, hanger, robots, config, stopped)
    finally:
        for robot in robots.values():
            robot.close()


def open_robots(config: Config) -> dict[str, Board]:
    """The robots' boards by name, each on a network of its own.

    Raises:
        ConfigError, BridgeError: see `run`.
    """
    names, bridge = robot_names(config.team.robots), config.bridge
    if config.team.robot == "go2":
        interface = bridge.interface or "lo"
        return {name: Go2Robot(bridge.domain + k, interface) for k, name in enumerate(names)}
    boards = dict[str, Board]()
    for number, name in enumerate(names, start=1):
        here, listener = (
            parse_address(
                getattr(bridge, key).replace("{number}", str(number)),
                f"bridge.{key}",
                Address("", 0),
            )
            for key in ("endpoint", "listen")
        )
        if not here.port or not listener.port:
            raise ConfigError(
                "bridge.endpoint, bridge.listen",
                "nothing",
                "HOST:PORT",
                "a simulated robot is not at the address of a real one: "
                "deploy/desk.toml has addresses on this machine",
            )
        boards[name] = UdpRobot(CODECS[config.team.robot], here, listener)
    return boards


def _serve(
    world: World,
    hanger: Hanger,
    robots: Mapping[str, Board],
    config: Config,
    stopped: Callable[[], bool],
) -> None:
    end_collection()
    take_priority(config.runtime.priority)
    rate, motors = Rate(_TICK, slack=3.0), dict.fromkeys(robots, OFF)
    _say(f"{len(robots)} simulated {config.robot.title} on the network")
    while not stopped():
        states = world.states()
        for k, (name, robot) in enumerate(robots.items()):
            if world.tick % robot.period_ms == 0:
                robot.report(states[name], world.motors.heat[k])
        rate.wait()
        commands = {name: robot.obey() for name, robot in robots.items()}
        for name, command in commands.items():
            if (doing := describe_motors(command)) != motors[name]:
                motors[name] = doing
                _say(f"{world.tick} ms: {name} {doing}")
        hanger.hold()
        for event in world.step({n: c for n, c in commands.items() if c is not None}):
            if event.code != FALL:  # robots that lie are no news here
                _say(f"{event.tick} ms: {event.kind} {event.robot} {event.detail}")
        world.settle()


def describe_motors(command: Command | None) -> str:
    """What the motors do under a command: off, damped or driven."""
    if command is None:
        return OFF
    return DRIVEN if command.kp.any() or command.tau.any() else DAMPED


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
