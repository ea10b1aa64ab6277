"""The way to a robot, by its kind."""

from __future__ import annotations

from quadriga.bridges.driver import RobotDriver
from quadriga.bridges.go2_driver import Go2Driver
from quadriga.bridges.udp_driver import UdpDriver
from quadriga.shared.config.bridge import BridgeConfig


def open_driver(kind: str, config: BridgeConfig, *, guards: bool = False) -> RobotDriver:
    """Open it.

    Args:
        kind: "a1", "go1" or "go2".
        config: where the robot is.
        guards: whether this is the guard's way: it only ever sends.

    Raises:
        ConfigError: no interface, or an address that does not parse.
        BridgeError: the way cannot be opened.
    """
    if kind == "go2":
        return Go2Driver(config, guards=guards)
    return UdpDriver(kind, config, guards=guards)
