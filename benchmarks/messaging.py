"""Time of the messages of a lock-step tick without world and robots: the plant link, both ways.

One process sends every robot a state and waits for all commands, as the sim server does; one
process per robot answers. Both transports carry the same packets between as many processes and
take turns in blocks. With one robot this is a round trip.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, closing
from typing import Any, Final

import numpy as np

from benchmarks.children import child, result_of, running
from quadriga.shared.bus.session import HERE, Bus, pause
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.link.agent_end import AgentEnd
from quadriga.shared.link.connections import CLOSED, NOTHING
from quadriga.shared.link.packets import STATE_SIZE
from quadriga.shared.link.plant_end import PlantEnd
from quadriga.shared.members import SIM
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic, monotonic_ns
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.team.endpoint import free_endpoint

_LINKS: Final = {"bus": "bus", "socket": "local"}  # `plant.link`, by the name of the figures
_BLOCK: Final = 250  # ticks of one transport before the other's turn
_WARM_UP: Final = 200
_PATIENCE: Final = 20.0  # s
_STATE: Final = State.from_row(0, 0, np.zeros(STATE_SIZE))


def measure(robots: int, ticks: int = 2000) -> dict[str, Any]:
    """Median and p99 of a tick, µs, by transport, for a team of this size."""
    teams = [
        load(None, {"team.robots": robots, "bus.endpoint": free_endpoint(), "plant.link": link})
        for link in _LINKS.values()
    ]
    others = [child(_robot, config, name) for config in teams for name in robot_names(robots)]
    with running(*others):
        times = result_of(_world, teams, ticks)
    return {"robots": robots, **times}


def _world(teams: Sequence[Config], ticks: int) -> dict[str, dict[str, float]]:
    times: list[list[int]] = [[] for _ in teams]
    with ExitStack() as stack:
        links = [_open(stack, config) for config in teams]
        for begin in range(-_WARM_UP, ticks, _BLOCK):
            for link, taken in zip(links, times, strict=True):
                took = [_time_tick(link) for _ in range(min(_BLOCK, ticks - begin))]
                taken += took if begin >= 0 else []
        for link in links:
            link.close("over")
    return dict(zip(_LINKS, map(_spread, times), strict=True))


def _open(stack: ExitStack, config: Config) -> PlantEnd:
    """A plant's end, all of whose agents are there."""
    names, deadline = robot_names(config.team.robots), monotonic() + _PATIENCE
    bus = stack.enter_context(Bus.open(config.bus, config.team.name, SIM))
    link = stack.enter_context(closing(PlantEnd(config, names, bus)))
    link.open()
    bus.declare(HERE)
    while len(link.connected) < len(names):
        if monotonic() > deadline:
            raise TimeoutError("a robot of the benchmark is not there")
        pause()
    return link


def _time_tick(link: PlantEnd) -> int:
    begun = monotonic_ns()
    for name in link.connected:
        link.send(name, _STATE)
    for name in reversed(link.connected):
        while (size := link.receive(name, wait=True)) == NOTHING:
            pass
        if size == CLOSED:
            raise ChildProcessError("a robot of the benchmark is gone")
    return monotonic_ns() - begun


def _spread(times: list[int]) -> dict[str, float]:
    median, p99 = 1e-3 * np.percentile(times, (50, 99))
    return {"median": float(median), "p99": float(p99)}


def _robot(config: Config, name: str) -> None:
    with (
        Bus.open(config.bus, config.team.name, name) as bus,
        closing(AgentEnd(config, name, bus)) as link,
    ):
        bus.declare(HERE)
        bus.wait_for(HERE, [SIM], _PATIENCE, lambda: False)
        link.open(lambda: False)
        take_priority(config.runtime.priority)
        while not (link.ended or link.closed):
            if link.receive(wait=True):
                link.send(link.command.view)
