"""The driver of the Go2 against an emulated one, over DDS on the loopback."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from quadriga.bridges.drivers import Go2Driver
from quadriga.bridges.plant import RobotPlant
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.unitree import rpc
from quadriga.shared.unitree.packets import ON
from tests.bridges.robots import config_of, holding
from tests.sim_server.emulator.test_go2_emulator import Bench, hasten, wait_until


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    hasten(monkeypatch)
    made = Bench(192)  # a domain of no other test
    yield made
    made.close()
    assert made.robot.malformed == 0


def executed(bench: Bench) -> list[int]:
    """What the robot has done of what it was asked for, but for questions."""
    queries = (rpc.API_VERSION, rpc.CHECK_MODE)
    return [api for api in bench.robot.executed if api not in queries]


def test_before_it_takes_over_nothing_is_written(bench: Bench) -> None:
    wait_until(lambda: bench.driver.receive() is not None)
    bench.driver.send(holding(config_of("go2"), mode=np.full(12, ON, np.uint8)))
    assert bench.driver.counters["unsent"] == 1
    sleep(0.05)
    assert bench.robot.received == 0
    assert bench.robot.controller == "normal"


def test_the_robots_own_controller_lies_down_once_lets_go_and_commands_arrive(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It writes commands until it has let go, and stays an idle writer of them."""
    monkeypatch.setattr("quadriga.sim_server.emulator.robot_emulator._MOTION_MS", 700)
    bench.driver.take_over()
    assert (bench.robot.controller, bench.driver.released) == ("", "normal")
    assert executed(bench) == [rpc.STAND_DOWN, rpc.RELEASE_MODE]
    assert not bench.robot._motions, "it was asked once"
    targets = holding(config_of("go2"), mode=np.full(12, ON, np.uint8), tau=np.arange(12.0))

    def arrived() -> bool:
        bench.driver.send(targets)
        return bench.command is not None

    wait_until(arrived)
    assert bench.command is not None
    np.testing.assert_allclose(bench.command.tau, np.arange(12.0))
    assert bench.driver.other_writers() == 0
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


def test_a_second_writer_is_refused_before_the_robots_own_controller_lets_go(bench: Bench) -> None:
    bench.do(bench.robot.add_second_writer)
    wait_until(lambda: bench.driver.other_writers() == 2)
    expected = "rt/lowcmd: got 2 others who write it, expected its own controller 'normal' alone"
    with pytest.raises(BridgeError, match=expected):
        bench.driver.take_over()
    assert (bench.robot.controller, bench.driver.released, executed(bench)) == ("normal", "", [])


def test_of_a_takeover_that_fails_later_the_operator_learns_whom_to_give_the_motors_back_to(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    await_mode = bench.driver._await_mode

    def intrude(controller: str) -> None:
        await_mode(controller)
        bench.do(bench.robot.add_second_writer)

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
        monkeypatch.setattr("quadriga.sim_server.emulator.robot_emulator._MOTION_MS", 60_000)
    bench.robot.lets_go = False
    expected = "controller: got 'normal', expected to let" if lies_down else "sport: got no answer"
    with pytest.raises(BridgeError, match=expected):
        bench.driver.take_over()
    assert executed(bench) == ([rpc.STAND_DOWN, rpc.RELEASE_MODE] if lies_down else [])
    assert bench.driver.released == ("normal" if lies_down else "")


def test_without_an_interface_there_is_one_clear_error() -> None:
    with pytest.raises(ConfigError, match=r"bridge.interface: got nothing, expected the one the"):
        Go2Driver(BridgeConfig())
