"""Time of a tick of the world by the size of the team: physics, sensors, detection of falls."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadriga.shared.config.load import load
from quadriga.shared.messages import Command
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.sim_server.world.world import World

_SETTLING = 200  # ticks, until all stand on their feet


def measure(robots: int, terrain: str, ticks: int = 1000) -> dict[str, Any]:
    """Median and p99 of `World.step`, µs, for robots that stand."""
    world = World(load(None, {"team.robots": robots, "world.terrain": terrain}))
    zero = np.zeros(N_JOINTS)
    stand = Command(0, 0, zero, A1.q_stand, zero, np.full(N_JOINTS, 200.0), np.full(N_JOINTS, 4.0))
    commands = dict.fromkeys(world.names, stand)
    times = []
    for tick in range(-_SETTLING, ticks):
        begun = monotonic_ns()
        world.step(commands)
        if tick >= 0:
            times.append(1e-3 * (monotonic_ns() - begun))
    median, p99 = np.percentile(times, (50, 99))
    return {"robots": robots, "terrain": terrain, "median": float(median), "p99": float(p99)}
