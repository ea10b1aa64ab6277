"""The driver of the Go2 against an emulated one, over DDS on the loopback."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from quadriga.bridges.drivers import Go2Driver
from quadriga.bridges.plant import RobotPlant
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.unitree import rpc
from quadriga.shared.unitree.codecs import GO2
from quadriga.shared.unitree.dds import LOW_COMMANDS, LOW_STATES, DdsParticipant, StructWriter
from quadriga.shared.unitree.packets import ON
from quadriga.sim_server.emulator import Go2Emulator
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding

WAIT = 10.0  # s
DOMAIN = 192  # of no other test
TARGETS = holding(config_of("go2"), mode=np.full(12, ON, np.uint8), tau=np.arange(12.0))
DAMPING = GO2.encode_command(replace(TARGETS, kp=np.zeros(12), tau=np.zeros(12)))


class Bench:
    """A robot in a thread of its own, whose ticks go on, a bridge's driver, and a second writer."""

    def __init__(self) -> None:
        self.robot, self.others = Go2Emulator(DOMAIN, "lo"), DdsParticipant(DOMAIN, "lo")
        self._state = World(load(overrides={"team.robots": 1})).states()["r1"]
        self._over = threading.Event()
        self.command: Command | None = None
        self.intruder: StructWriter | None = None  # writes every other millisecond
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        self.driver = Go2Driver(BridgeConfig(interface="lo", domain=DOMAIN))

    def _run(self) -> None:
        tick = 0
        while not self._over.is_set():
            self.robot.report(replace(self._state, tick=tick), np.zeros(12))
            if (intruder := self.intruder) is not None and tick % 2:
                intruder.send(DAMPING)
            self.command = self.robot.obey()
            tick += 1
            sleep(0.001)

    def intrude(self) -> None:
        self.intruder = StructWriter(self.others, LOW_COMMANDS)

    def commands(self) -> bool:
        """Send a command; whether the robot follows one that has gains."""
        self.driver.send(TARGETS)
        return self.command is not None and bool(self.command.kp.any())

    def executed(self) -> list[int]:
        """What the robot has done of what it was asked for, but for questions."""
        queries = (rpc.API_VERSION, rpc.CHECK_MODE)
        return [api for api in self.robot.executed if api not in queries]

    def close(self) -> None:
        self.driver.close()
        self._over.set()
        self._thread.join()
        self.robot.close()
        self.others.close()


def wait_until(happens: Callable[[], bool]) -> None:
    deadline = monotonic() + WAIT
    while not happens():
        assert monotonic() < deadline
        sleep(0.001)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    """Robot and driver take less time than real ones need."""
    for name in ("bridges.drivers._STILL_S", "bridges.drivers._WATCHED"):
        monkeypatch.setattr(f"quadriga.{name}", 0.1)
    monkeypatch.setattr("quadriga.sim_server.emulator._MOTION_MS", 10)
    made = Bench()
    yield made
    made.close()


def test_before_it_takes_over_nothing_is_written(bench: Bench) -> None:
    wait_until(lambda: bench.driver.receive() is not None)
    bench.driver.send(TARGETS)
    assert bench.driver.counters["unsent"] == 1
    sleep(0.05)
    assert (bench.robot.received, bench.robot.malformed) == (0, 0)
    assert bench.robot.controller == "normal"


def test_the_robots_own_controller_lies_down_once_lets_go_and_commands_arrive(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It writes commands until it has let go, and stays an idle writer of them."""
    monkeypatch.setattr("quadriga.sim_server.emulator._MOTION_MS", 700)
    bench.driver.take_over()
    assert (bench.robot.controller, bench.driver.released) == ("", "normal")
    assert bench.executed() == [rpc.STAND_DOWN, rpc.RELEASE_MODE]
    assert not bench.robot._motions, "it was asked once"
    wait_until(bench.commands)
    assert bench.command is not None
    np.testing.assert_allclose(bench.command.tau, np.arange(12.0))
    assert (bench.driver.other_writers(), bench.robot.malformed) == (0, 0)
    bench.driver.give_back(bench.driver.released)
    assert bench.robot.controller == "normal"
    wait_until(lambda: bench.command is None)
    monkeypatch.setattr("quadriga.bridges.drivers._LETTING_GO", 0.5)
    expected = r"own controller: got 'normal', expected 'dance', which it is asked for"
    with pytest.raises(BridgeError, match=expected):
        bench.driver.give_back("dance")
    calls = bench.robot.executed
    before = [calls[k - 1] for k, api in enumerate(calls) if api == rpc.SELECT_MODE]
    assert before == [rpc.API_VERSION] * 2, "a query each shows that the robot is there"


def test_a_second_writer_is_seen_while_it_writes(bench: Bench) -> None:
    bench.driver.take_over()
    wait_until(bench.commands)
    assert bench.driver.other_writers() == 0
    bench.intrude()
    wait_until(lambda: bench.driver.other_writers() == 1)
    wait_until(lambda: bench.command is not None and not bench.command.kp.any())
    bench.intruder = None
    sleep(0.02)
    bench.driver.other_writers()
    wait_until(bench.commands)
    assert bench.driver.other_writers() == 0


def test_a_second_writer_is_refused_before_the_robots_own_controller_lets_go(bench: Bench) -> None:
    bench.intrude()
    wait_until(lambda: bench.driver.other_writers() == 2)
    expected = "rt/lowcmd: got 2 others who write it, expected its own controller 'normal' alone"
    with pytest.raises(BridgeError, match=expected):
        bench.driver.take_over()
    state = bench.robot.controller, bench.driver.released, bench.executed()
    assert state == ("normal", "", [])


def test_of_a_takeover_that_fails_later_the_operator_learns_whom_to_give_the_motors_back_to(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    await_mode = bench.driver._await_mode

    def intrude(controller: str) -> None:
        await_mode(controller)
        bench.intrude()

    monkeypatch.setattr(bench.driver, "_await_mode", intrude)
    said = list[str]()
    plant = RobotPlant(config_of("go2"), "r1", bench.driver, watchdog=None, say=said.append)
    with pytest.raises(BridgeError, match="rt/lowcmd: got 1 others who write it, expected nobody"):
        plant.take_charge()
    assert ["--restore normal" in line for line in said] == [True]


@pytest.mark.parametrize("lies_down", [False, True])
def test_a_controller_that_does_not_lie_down_or_let_go_is_named(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, lies_down: bool
) -> None:
    wait_until(lambda: bench.driver.receive() is not None)
    monkeypatch.setattr("quadriga.bridges.drivers._LETTING_GO", 0.5)
    if not lies_down:
        monkeypatch.setattr("quadriga.sim_server.emulator._MOTION_MS", 60_000)
    bench.robot.lets_go = False
    expected = "controller: got 'normal', expected to let" if lies_down else "sport: got no answer"
    with pytest.raises(BridgeError, match=expected):
        bench.driver.take_over()
    assert bench.executed() == ([rpc.STAND_DOWN, rpc.RELEASE_MODE] if lies_down else [])
    assert bench.driver.released == ("normal" if lies_down else "")


def test_without_an_interface_there_is_one_clear_error() -> None:
    with pytest.raises(ConfigError, match=r"bridge.interface: got nothing, expected the one the"):
        Go2Driver(BridgeConfig())


def test_damaged_structs_are_counted_on_both_sides(bench: Bench) -> None:
    ways = [StructWriter(bench.others, topic) for topic in (LOW_COMMANDS, LOW_STATES)]

    def counted() -> bool:
        for writer, topic in zip(ways, (LOW_COMMANDS, LOW_STATES), strict=True):
            writer.send(b"\1" * topic.size)
        bench.driver.receive()
        return bench.robot.malformed > 3 and bench.driver.counters["malformed"] > 3

    wait_until(counted)
    assert bench.driver.counters["malformed_crc"] > 3
