"""What befalls a simulated Go2, as its bridge's driver sees it over DDS on the loopback."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from queue import SimpleQueue

import numpy as np
import pytest

from quadriga.bridges.go2_driver import Go2Driver
from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.load import load
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.unitree.remote import read_remote
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.native.board import COMMANDS, REPORTS
from quadriga.sim_server.native.go2_robot import Go2Robot
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding

WAIT = 10.0  # s
TARGETS = holding(config_of("go2"), mode=np.ones(12, np.uint8))


class Desk:
    """A robot in a thread of its own, whose ticks go on, and a bridge's driver."""

    def __init__(self, domain: int) -> None:
        self.robot = Go2Robot(domain, "lo", seed=(3,))
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
    for name in ("bridges.go2_driver._STILL_S", "bridges.go2_driver._WATCHED"):
        patch.setattr(f"quadriga.{name}", 0.1)
    patch.setattr("quadriga.sim_server.native.go2_robot._MOTION_MS", 10)


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    hasten(monkeypatch)
    made = Desk(189)  # a domain of no other test
    made.driver.take_over()
    yield made
    made.close()


def commands(desk: Desk) -> bool:
    desk.driver.send(TARGETS)
    return desk.command is not None and bool(desk.command.kp.any())


def is_silent(desk: Desk) -> bool:
    """Whether nothing comes for as long as a robot that is on would send fifty reports."""
    desk.driver.receive()
    sleep(0.1)
    return desk.driver.receive() is None


def test_a_second_writer_is_seen_damps_the_robot_and_goes(desk: Desk) -> None:
    wait_until(lambda: commands(desk))
    assert desk.driver.other_writers() == 0
    desk.do(lambda: desk.robot.intrude(there=True))
    wait_until(lambda: desk.driver.other_writers() == 1)
    wait_until(lambda: desk.command is not None and not desk.command.kp.any())
    desk.do(lambda: desk.robot.intrude(there=False))
    sleep(0.02)
    desk.driver.other_writers()
    wait_until(lambda: commands(desk))
    assert desk.driver.other_writers() == 0


def test_damaged_structs_are_counted_on_both_sides(desk: Desk) -> None:
    wait_until(lambda: commands(desk))
    desk.do(lambda: desk.robot.disturb("garbage", 1.0, (COMMANDS, REPORTS)))

    def counted() -> bool:
        desk.driver.send(TARGETS)
        desk.driver.receive()
        return desk.robot.malformed > 3 and desk.driver.counters["malformed"] > 3

    wait_until(counted)


def test_a_robot_that_was_off_has_its_own_controller_in_charge_again(desk: Desk) -> None:
    wait_until(lambda: commands(desk))
    desk.do(lambda: desk.robot.switch(on=False))
    assert desk.command is None
    wait_until(lambda: is_silent(desk))
    desk.do(lambda: desk.robot.switch(on=True))
    assert desk.robot.controller == "normal"
    wait_until(lambda: desk.driver.receive() is not None)
    for _ in range(50):  # ticks, far more than a command takes to come
        assert not commands(desk), "its own controller has the motors"
        desk.do(lambda: None)


def test_buttons_and_battery_reach_the_bridge(desk: Desk) -> None:
    desk.do(lambda: desk.robot.condition.press(frozenset({"L2", "B"}), None))
    desk.do(lambda: desk.robot.condition.set_charge(8.0, 0))

    def seen() -> bool:
        report = desk.driver.receive()
        if report is None or report.battery is None:
            return False
        return read_remote(report.remote).pressed == {"L2", "B"} and report.battery.charge == 8

    wait_until(seen)
