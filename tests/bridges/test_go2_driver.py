"""The driver of the Go2 against the board of a simulated one, over DDS on the loopback."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from quadriga.bridges.go2_driver import Go2Driver
from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.load import load
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.unitree import go2
from quadriga.shared.unitree.dds import StructWriter
from quadriga.shared.unitree.packets import ON
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.native.go2_robot import Go2Robot
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding

DOMAIN = 192  # of no other test
WAIT = 10.0  # s


class LivingRobot:
    """A board that reports and obeys in a thread of its own; a domain of its own participant."""

    def __init__(self) -> None:
        self.robot = Go2Robot(DOMAIN, "lo")
        self._state = World(load(overrides={"team.robots": 1})).states()["r1"]
        self._over = threading.Event()
        self.command: Command | None = None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.is_set():
            self.robot.report(self._state, np.zeros(12))
            self.command = self.robot.obey()
            sleep(0.002)

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.robot.close()


@pytest.fixture
def living() -> Iterator[LivingRobot]:
    made = LivingRobot()
    yield made
    made.close()


@pytest.fixture
def driver(living: LivingRobot) -> Iterator[Go2Driver]:
    made = Go2Driver(BridgeConfig(interface="lo", domain=DOMAIN))
    yield made
    made.close()
    assert living.robot.malformed == 0


def wait_until(happens: Callable[[], bool]) -> None:
    deadline = monotonic() + WAIT
    while not happens():
        assert monotonic() < deadline
        sleep(0.001)


def test_before_it_takes_over_nothing_is_written(living: LivingRobot, driver: Go2Driver) -> None:
    wait_until(lambda: driver.receive() is not None)
    driver.send(holding(config_of("go2"), mode=np.full(12, ON, np.uint8)))
    assert driver.counters["unsent"] == 1
    sleep(0.05)
    assert living.robot.received == 0
    assert living.robot.controller == "normal"


def test_the_robots_own_controller_lets_go_and_commands_arrive(
    living: LivingRobot, driver: Go2Driver
) -> None:
    driver.take_over()
    assert (living.robot.controller, driver.released) == ("", "normal")
    targets = holding(config_of("go2"), mode=np.full(12, ON, np.uint8), tau=np.arange(12.0))

    def arrived() -> bool:
        driver.send(targets)
        return living.command is not None

    wait_until(arrived)
    assert living.command is not None
    np.testing.assert_allclose(living.command.tau, np.arange(12.0))
    assert driver.other_writers() == 0
    driver.give_back(driver.released)
    assert living.robot.controller == "normal"
    wait_until(lambda: living.command is None)


def test_a_controller_that_the_robot_does_not_have_is_named(
    driver: Go2Driver, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadriga.bridges.go2_driver._LETTING_GO", 0.2)
    expected = r"own controller: got 'normal', expected 'dance', which it is asked for"
    with pytest.raises(BridgeError, match=expected):
        driver.give_back("dance")


def test_a_second_writer_is_seen_and_refused(living: LivingRobot, driver: Go2Driver) -> None:
    participant = living.robot._participant
    topic = participant.struct_topic(go2.COMMAND_TOPIC, go2.COMMAND_TYPE, go2.COMMAND)
    StructWriter(participant, topic, go2.COMMAND.itemsize)
    wait_until(lambda: driver.other_writers() == 1)
    with pytest.raises(BridgeError, match="rt/lowcmd: got 1 others who write it, expected nobody"):
        driver.take_over()


def test_a_controller_that_does_not_let_go_is_named(
    living: LivingRobot, driver: Go2Driver, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadriga.bridges.go2_driver._LETTING_GO", 0.2)
    living.robot.lets_go = False
    with pytest.raises(BridgeError, match="own controller: got normal, expected to let go"):
        driver.take_over()


def test_without_an_interface_there_is_one_clear_error() -> None:
    with pytest.raises(ConfigError, match=r"bridge.interface: got nothing, expected the one the"):
        Go2Driver(BridgeConfig())
