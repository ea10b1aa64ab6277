"""From the configuration to the bridge of one robot."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

from quadriga.bridges.guard import Guard
from quadriga.bridges.joint_tester import JointTester
from quadriga.bridges.open_driver import open_driver
from quadriga.bridges.robot_plant import RobotPlant
from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.printable import printable_line


def build_bridge(
    config: Config,
    names: tuple[str, ...],
    *,
    armed: bool = False,
    stopped: Callable[[], bool] = bool,
) -> RobotPlant:
    """The plant of a robot behind its bridge, which has looked at it; a `PlantFactory`.

    Args:
        config: the team's configuration.
        names: one robot.
        armed: whether it may be commanded.
        stopped: asked often whether to look no longer.

    Raises:
        ConfigError: more than one robot, or no address or interface that can be used.
        BridgeError: the way to the robot cannot be opened.
        CheckError: the robot is not as it must be.
    """
    if len(names) != 1:
        raise ConfigError("team.plants", f"a plant of {', '.join(names)}", "'each'")
    kind, bridge = config.team.robot, bridge_of(config, names[0])
    driver = open_driver(kind, bridge)
    guard = Guard(kind, bridge) if armed else None
    plant = RobotPlant(config, names[0], driver, guard=guard, say=_say)
    try:
        plant.look(stopped)
    except BaseException:
        plant.finish()
        raise
    return plant


def build_joint_tester(config: Config, name: str) -> JointTester:
    """The test of the joints of the robot of this name.

    Raises:
        ConfigError: no address or interface that can be used.
        BridgeError: the way to the robot cannot be opened.
    """
    kind, bridge = config.team.robot, bridge_of(config, name)
    driver, guard = open_driver(kind, bridge), Guard(kind, bridge)
    return JointTester(config, name, driver, guard, _say)


def bridge_of(config: Config, name: str) -> BridgeConfig:
    """The section `bridge` for the robot of this name, with its number filled in."""
    bridge, number = config.bridge, name.removeprefix("r")
    # On the loopback, robots that real ones keep apart by their cables have domains of their own.
    domain = bridge.domain + (int(number) - 1 if bridge.interface == "lo" else 0)
    return replace(
        bridge,
        domain=domain,
        interface=bridge.interface.replace("{number}", number),
        endpoint=bridge.endpoint.replace("{number}", number),
        listen=bridge.listen.replace("{number}", number),
    )


def _say(text: str) -> None:
    print(printable_line(f"bridge: {text}"), file=sys.stderr, flush=True)
