"""Cost of a lock-step tick over the bus: real world, real Zenoh, agents that merely stand.

Run: python -m benchmarks.lockstep [--robots 1 3 5] [--seconds 4]
"""

from __future__ import annotations

import argparse
import resource
from multiprocessing.synchronize import Event
from typing import Any

import numpy as np

from benchmarks.children import SPAWN, child, running
from quadriga.plant.lockstep import run_lockstep
from quadriga.plant.server import PlantServer
from quadriga.shared.bus.barrier import meet, start_together
from quadriga.shared.bus.zenoh_bus import READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.members import SIM
from quadriga.shared.robot.a1 import N_JOINTS, q_stand, robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Command, State
from quadriga.shared.wire.topics import COMMAND, STATE
from quadriga.sim_server.world.world import World
from quadriga.team.endpoint import free_endpoint


def processor_time() -> float:
    """Seconds of processor time of this process, all its threads, user and system."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def stand(config: Config, robot: str, ended: Event, spent: Any) -> None:
    """Run an agent that answers every state with PD control around the standing pose."""
    zero, kp, kd = np.zeros(N_JOINTS), np.full(N_JOINTS, 80.0), np.full(N_JOINTS, 3.0)
    with Bus.open(config.bus, config.team.name, robot) as bus:
        bus.subscribe(STATE.key(config.team.name, robot))
        put = bus.publisher(COMMAND.key(config.team.name, robot))
        meet(bus, config, ended.is_set)
        bus.declare(READY)
        begun = processor_time()
        while not ended.is_set():
            packet = bus.get(0.1)
            if packet is not None:
                state = decode(packet[1], State)
                put(encode(Command(state.tick, state.stamp_ns, zero, q_stand(), zero, kp, kd)))
        spent.value = processor_time() - begun


def idle(config: Config, name: str, ended: Event) -> None:
    """Run a member of the team that subscribes to nothing."""
    with Bus.open(config.bus, config.team.name, name) as bus:
        meet(bus, config, ended.is_set)
        bus.declare(READY)
        ended.wait()


def measure(robots: int, seconds: float) -> None:
    """Print the cost of one tick for a team of this size."""
    config = load(
        None,
        {
            "team.robots": robots,
            "world.seconds": seconds,
            "bus.endpoint": free_endpoint(),
            "recorder.enabled": False,
        },
    )
    ended = SPAWN.Event()
    spent = {name: SPAWN.Value("d", 0.0) for name in robot_names(robots)}
    others = [child(stand, config, name, ended, value) for name, value in spent.items()]
    others.append(child(idle, config, "operator", ended))
    world = World(config)
    begun = monotonic()
    for _ in range(1000):
        world.step({})
    physics = monotonic() - begun
    world = World(config)
    with Bus.open(config.bus, config.team.name, SIM) as bus:
        bus.subscribe(COMMAND.key(config.team.name, "*"))
        server = PlantServer(config, world, bus)
        with running(*others):
            meet(bus, config, ended.is_set)
            start_together(bus, config, ended.is_set)
            begun, used = monotonic(), processor_time()
            run_lockstep(server, ended.is_set)
            took, used = monotonic() - begun, processor_time() - used
            ended.set()
    agents = sum(value.value for value in spent.values()) / robots
    print(
        f"n = {robots}: {1e3 * took / seconds:.0f} µs a tick, physics {1e3 * physics:.0f}; "
        f"processor time {1e3 * used / seconds:.0f} µs of the sim server, "
        f"{1e3 * agents / seconds:.0f} µs of each agent"
    )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--robots", type=int, nargs="+", default=[1, 3, 5])
    arguments.add_argument("--seconds", type=float, default=4.0)
    options = arguments.parse_args()
    for count in options.robots:
        measure(count, options.seconds)
