"""From the configuration to the bridge of one robot."""

from __future__ import annotations

import sys
from dataclasses import replace

from quadriga.bridges.driver import RobotDriver
from quadriga.bridges.go2_driver import Go2Driver
from quadriga.bridges.robot_plant import RobotPlant
from quadriga.bridges.udp_driver import UdpDriver
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


def build_bridge(config: Config, names: tuple[str, ...], *, armed: bool = False) -> RobotPlant:
    """The plant of a robot behind its bridge; a `PlantFactory`.

    Args:
        config: the team's configuration.
        names: one robot.
        armed: whether it may be commanded.

    Raises:
        ConfigError: more than one robot, or no address or interface that can be used.
        BridgeError: the way to the robot cannot be opened.
    """
    if len(names) != 1:
        raise ConfigError("team.plants", f"a plant of {', '.join(names)}", "'each'")
    driver = open_driver(config, names[0])
    return RobotPlant(config, names[0], driver, armed=armed, say=_say)


def open_driver(config: Config, name: str) -> RobotDriver:
    """The way to the robot of this name, by its kind.

    Raises:
        ConfigError: no interface, or an address that does not parse.
        BridgeError: the way cannot be opened.
    """
    kind, number = config.team.robot, name.removeprefix("r")
    # On the loopback, robots that real ones keep apart by their cables have domains of their own.
    domain = int(number) - 1 if config.bridge.interface == "lo" else 0
    bridge = replace(
        config.bridge,
        endpoint=config.bridge.endpoint.replace("{number}", number),
        listen=config.bridge.listen.replace("{number}", number),
    )
    if kind == "go2":
        return Go2Driver(replace(bridge, domain=bridge.domain + domain))
    return UdpDriver(kind, bridge)


def _say(text: str) -> None:
    print(f"bridge: {text}", file=sys.stderr, flush=True)
