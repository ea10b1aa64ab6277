"""From the configuration to the boards of the simulated robots, each on a network of its own."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Final

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.unitree.udp import CODECS
from quadriga.shared.unitree.udp_port import Address, parse_address
from quadriga.sim_server.native.board import Board
from quadriga.sim_server.native.go2_robot import Go2Robot
from quadriga.sim_server.native.udp_robot import UdpRobot

_STREAM: Final = 11  # of the world's seed: what boards and their networks do by chance
LOOPBACK: Final = "lo"


def open_boards(config: Config) -> dict[str, Board]:
    """The robots' boards by name.

    Raises:
        ConfigError: an address does not parse or is missing.
        BridgeError: a port is taken, or there is no such interface.
    """
    boards = dict[str, Board]()
    with ExitStack() as stack:
        for index, name in enumerate(robot_names(config.team.robots)):
            seed = (config.world.seed, _STREAM, index)
            board = _open_board(config.team.robot, config.bridge, index, seed)
            stack.callback(board.close)
            boards[name] = board
        stack.pop_all()
    return boards


def _open_board(kind: str, bridge: BridgeConfig, index: int, seed: Sequence[int]) -> Board:
    number = str(index + 1)
    if kind == "go2":
        interface = (bridge.interface or LOOPBACK).replace("{number}", number)
        # Robots on one loopback, which real ones are not, have domains of their own.
        domain = bridge.domain + (index if interface == LOOPBACK else 0)
        return Go2Robot(domain, interface, seed)
    text = bridge.endpoint.replace("{number}", number)
    here = parse_address(text, "bridge.endpoint", Address("", 0))
    if not here.port:
        raise ConfigError(
            "bridge.endpoint",
            "nothing",
            "HOST:PORT",
            "a simulated robot is not at the address of a real one: "
            "deploy/desk.toml has addresses on this machine",
        )
    return UdpRobot(CODECS[kind], here, seed)
