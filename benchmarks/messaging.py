"""Time of the messages of a lock-step tick without world and robots: the Bus and raw sockets.

One process sends every robot a state and waits for all commands, as the sim server does; one
process per robot answers. Both transports carry the same payloads between as many processes and
take turns in blocks. With one robot this is a round trip. Nothing is decoded.
"""

from __future__ import annotations

import socket
import tempfile
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.children import SPAWN, child, result_of, running
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.members import SIM
from quadriga.shared.messages import Command, State
from quadriga.shared.robots.conventions import N_JOINTS, robot_names
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.topics import COMMAND, STATE
from quadriga.team.endpoint import free_endpoint

TRANSPORTS: Final = ("bus", "socket")
_BLOCK: Final = 250  # ticks of one transport before the other's turn
_WARM_UP: Final = 200
_BUFFER: Final = 1 << 16
_PATIENCE: Final = 20.0  # s


def measure(robots: int, ticks: int = 2000) -> dict[str, Any]:
    """Median and p99 of a tick, µs, by transport, for a team of this size."""
    config = load(None, {"team.robots": robots, "bus.endpoint": free_endpoint()})
    ended = SPAWN.Event()
    with tempfile.TemporaryDirectory() as folder:
        place = str(Path(folder) / "socket")
        names = robot_names(robots)
        others = [child(_bus_robot, config, name, ended) for name in names]
        others += [child(_socket_robot, config, place) for _ in names]
        with running(*others):
            times = result_of(_world, config, place, ticks)
            ended.set()
    return {"robots": robots, **times}


def _world(config: Config, place: str, ticks: int) -> dict[str, dict[str, float]]:
    names, team = robot_names(config.team.robots), config.team.name
    state = state_bytes()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
        listener.settimeout(_PATIENCE)
        listener.bind(place)
        listener.listen(len(names))
        with Bus.open(config.bus, team, SIM) as bus:
            bus.subscribe(COMMAND.key(team, "*"))
            puts = [bus.publisher(STATE.key(team, name)) for name in names]
            bus.declare(HERE)
            bus.wait_for(HERE, names, _PATIENCE, lambda: False)
            links = [listener.accept()[0] for _ in names]

            def by_bus() -> None:
                for put in puts:
                    put(state)
                for _ in puts:
                    if bus.get(_PATIENCE) is None:
                        raise TimeoutError("a robot of the benchmark no longer answers")

            def by_socket() -> None:
                for link in links:
                    link.send(state)
                for link in links:
                    link.recv(_BUFFER)

            times: dict[str, list[int]] = {name: [] for name in TRANSPORTS}
            for begin in range(-_WARM_UP, ticks, _BLOCK):
                for name, tick in zip(TRANSPORTS, (by_bus, by_socket), strict=True):
                    took = [_time_tick(tick) for _ in range(min(_BLOCK, ticks - begin))]
                    times[name] += took if begin >= 0 else []
            for link in links:
                link.close()
    return {name: _spread(block) for name, block in times.items()}


def _time_tick(tick: Any) -> int:
    begun = monotonic_ns()
    tick()
    return monotonic_ns() - begun


def _spread(times: list[int]) -> dict[str, float]:
    median, p99 = 1e-3 * np.percentile(times, (50, 99))
    return {"median": float(median), "p99": float(p99)}


def _bus_robot(config: Config, name: str, ended: Event) -> None:
    team, command = config.team.name, command_bytes()
    with Bus.open(config.bus, team, name) as bus:
        bus.subscribe(STATE.key(team, name))
        put = bus.publisher(COMMAND.key(team, name))
        bus.declare(HERE)
        take_priority(config.runtime.priority)
        while not ended.is_set():
            if bus.get(0.2) is not None:
                put(command)


def _socket_robot(config: Config, place: str) -> None:
    command, deadline = command_bytes(), monotonic() + _PATIENCE
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        while True:
            try:
                link.connect(place)
                break
            except (FileNotFoundError, ConnectionRefusedError):
                if monotonic() > deadline:
                    raise
                sleep(0.01)
        take_priority(config.runtime.priority)
        while link.recv(_BUFFER):
            link.send(command)


def state_bytes() -> bytes:
    """A state, as the world sends it."""
    rows = (np.zeros(count) for count in (12, 12, 12, 4, 3, 3, 4))
    return encode(State(0, 0, *rows))


def command_bytes() -> bytes:
    """A command, as a robot answers."""
    rows = np.zeros((5, N_JOINTS))
    return encode(Command(0, 0, *rows))
