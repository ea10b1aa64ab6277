"""SHELL of the sim server: receives the robots' commands, steps one world, sends sensor data."""

from __future__ import annotations

from collections.abc import Callable

from quadriga.plant.lockstep import run_lockstep
from quadriga.plant.realtime import run_realtime
from quadriga.plant.server import PlantServer
from quadriga.shared.bus.barrier import meet, start_together
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.members import SIM
from quadriga.shared.runtime.collector import end_collection
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.wire.topics import topics_for
from quadriga.sim_server.world.world import World


def run(config: Config, stopped: Callable[[], bool] | None = None) -> None:
    """Simulate the team until `world.seconds` are over, a robot has fallen, or it is stopped.

    The others learn of the end from the event `stop`, and from the absence of this process.

    Args:
        config: the team's configuration.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.

    Raises:
        ConfigError: the world cannot be built from the configuration.
        BusError: the bus cannot be opened, or the team is not complete in time.
    """
    stopped = stopped or stop_on_signals()
    world = World(config)
    with Bus.open(config.bus, config.team.name, SIM, stopped) as bus:
        for topic in topics_for(SIM):
            bus.subscribe(topic.key(config.team.name, "*"))
        server = PlantServer(config, world, bus)
        if not (meet(bus, config, stopped) and start_together(bus, config, stopped)):
            return
        end_collection()
        take_priority(config.runtime.priority)
        loop = run_realtime if config.world.mode == "realtime" else run_lockstep
        end = loop(server, stopped)
        server.announce(end.code, "", end.detail)
