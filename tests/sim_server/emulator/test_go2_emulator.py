"""What befalls an emulated Go2, as its bridge's driver sees it over DDS on the loopback."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from queue import SimpleQueue

import numpy as np
import pytest

from quadriga.bridges.drivers import Go2Driver
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.sim_server.emulator.link import LinkFaults
from quadriga.sim_server.emulator.robot_emulator import Go2Emulator
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding

WAIT = 10.0  # s
TARGETS = holding(config_of("go2"), mode=np.ones(12, np.uint8))


class Bench:
    """A robot in a thread of its own, whose ticks go on, and a bridge's driver."""

    def __init__(self, domain: int) -> None:
        self.robot = Go2Emulator(domain, "lo", seed=(3,))
        self._state = World(load(overrides={"team.robots": 1})).states()["r1"]
        self._over = threading.Event()
        self.command: Command | None = None
        self._jobs = SimpleQueue[tuple[Callable[[], None], threading.Event]]()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        self.driver = Go2Driver(BridgeConfig(interface="lo", domain=domain))

    def _run(self) -> None:
        tick = 0
        while not self._over.is_set():
            done = []
            while not self._jobs.empty():
                job, event = self._jobs.get()
                job()
                done.append(event)
            self.robot.report(replace(self._state, tick=tick), np.zeros(12))
            self.command = self.robot.obey()
            tick += 1
            for event in done:
                event.set()
            sleep(0.001)

    def do(self, job: Callable[[], None]) -> None:
        """Have the robot's thread do it, and wait for the end of the tick that begins with it."""
        event = threading.Event()
        self._jobs.put((job, event))
        assert event.wait(WAIT)

    def close(self) -> None:
        self.driver.close()
        self._over.set()
        self._thread.join()
        self.robot.close()


def wait_until(happens: Callable[[], bool]) -> None:
    deadline = monotonic() + WAIT
    while not happens():
        assert monotonic() < deadline
        sleep(0.001)


def hasten(patch: pytest.MonkeyPatch) -> None:
    """Have robots and drivers take less time than real ones need."""
    for name in ("bridges.drivers._STILL_S", "bridges.drivers._WATCHED"):
        patch.setattr(f"quadriga.{name}", 0.1)
    patch.setattr("quadriga.sim_server.emulator.robot_emulator._MOTION_MS", 10)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    hasten(monkeypatch)
    made = Bench(189)  # a domain of no other test
    made.driver.take_over()
    yield made
    made.close()


def commands(bench: Bench) -> bool:
    bench.driver.send(TARGETS)
    return bench.command is not None and bool(bench.command.kp.any())


def test_a_second_writer_is_seen_damps_the_robot_and_goes(bench: Bench) -> None:
    wait_until(lambda: commands(bench))
    assert bench.driver.other_writers() == 0
    bench.do(bench.robot.add_second_writer)
    wait_until(lambda: bench.driver.other_writers() == 1)
    wait_until(lambda: bench.command is not None and not bench.command.kp.any())
    bench.do(bench.robot.clear)
    sleep(0.02)
    bench.driver.other_writers()
    wait_until(lambda: commands(bench))
    assert bench.driver.other_writers() == 0


def test_damaged_structs_are_counted_on_both_sides(bench: Bench) -> None:
    wait_until(lambda: commands(bench))
    bench.robot.inwards.faults = bench.robot.outwards.faults = LinkFaults(garbage=1.0)

    def counted() -> bool:
        bench.driver.send(TARGETS)
        bench.driver.receive()
        return bench.robot.malformed > 3 and bench.driver.counters["malformed"] > 3

    wait_until(counted)
