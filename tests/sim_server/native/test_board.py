"""A robot's network and what befalls it, as a bridge's driver sees it over real sockets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from quadriga.bridges.udp_driver import UdpDriver
from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.load import load
from quadriga.shared.unitree.packets import RobotReport
from quadriga.shared.unitree.udp import A1
from quadriga.shared.unitree.udp_port import Address
from quadriga.shared.wire.messages import Command
from quadriga.sim_server.native.board import COMMANDS, REPORTS
from quadriga.sim_server.native.udp_robot import UdpRobot
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding
from tests.bridges.test_udp_driver import HOST, free_port

STATE = World(load(overrides={"team.robots": 1})).states()["r1"]
COLD = np.zeros(12)
DRIVING = holding(config_of(), tau=np.ones(12))


class Desk:
    """A robot and a bridge's driver, a millisecond at a time."""

    def __init__(self) -> None:
        robot, listen = Address(HOST, free_port()), Address(HOST, free_port())
        self.robot = UdpRobot(A1, robot, seed=(5,))
        self.driver = UdpDriver("a1", BridgeConfig(f"{HOST}:{robot.port}", f"{HOST}:{listen.port}"))
        self.driver.introduce()
        self.robot.obey()
        self.robot.received = 0
        self.now = 0
        self.command: Command | None = None

    def tick(self, *, send: bool = False) -> RobotReport | None:
        """The robot reports, the bridge receives and may send, the robot obeys."""
        self.robot.report(replace(STATE, tick=self.now), COLD)
        report = self.driver.receive()
        if send:
            self.driver.send(DRIVING)
        self.command = self.robot.obey()
        self.now += 1
        return report

    def ticks(self, n: int, *, send: bool = False) -> int:
        """So many milliseconds; in how many a report came."""
        return sum(self.tick(send=send) is not None for _ in range(n))


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk()
    yield made
    made.driver.close()
    made.robot.close()


def test_all_packets_are_lost_on_the_way_asked_for(desk: Desk) -> None:
    desk.robot.disturb("loss", 1.0, (REPORTS,))
    assert desk.ticks(20, send=True) == 0
    assert desk.robot.received == 20
    desk.robot.disturb("loss", 0.0, (REPORTS,))
    desk.robot.disturb("loss", 1.0, (COMMANDS,))
    assert desk.ticks(20, send=True) == 20
    assert desk.robot.received == 20
    assert desk.command is not None, "it goes on with the last command"


def test_a_delay_is_one_of_milliseconds_each_way(desk: Desk) -> None:
    desk.robot.disturb("delay", 5.0, (REPORTS, COMMANDS))
    first = [desk.tick(send=True) for _ in range(6)]
    assert first[:5] == [None] * 5
    assert first[5] is not None
    assert desk.command is not None, "sent at 0, it arrives at 5"
    assert desk.robot.received == 1
    assert desk.ticks(20) == 20


def test_repeated_swapped_and_damaged_packets_are_what_the_driver_counts(desk: Desk) -> None:
    desk.robot.disturb("duplicate", 1.0, (REPORTS,))
    desk.ticks(10)
    assert desk.driver.counters["repeated"] == 10
    desk.robot.clear()
    desk.robot.disturb("reorder", 1.0, (REPORTS,))
    desk.ticks(10)
    assert desk.driver.counters["older"] == 5
    desk.robot.clear()
    desk.robot.disturb("garbage", 1.0, (REPORTS, COMMANDS))
    assert desk.ticks(50, send=True) == 0
    assert desk.driver.counters["malformed"] == 50
    assert desk.robot.malformed == 50
    assert desk.command is None


def test_a_robot_that_is_off_says_nothing_and_forgets(desk: Desk) -> None:
    desk.ticks(5, send=True)
    assert desk.command is not None
    desk.robot.switch(on=False)
    assert desk.ticks(20, send=True) == 0
    assert desk.command is None
    desk.robot.switch(on=True)
    assert desk.ticks(5) == 0, "nor does it know whom to tell"
    desk.driver.introduce()
    assert desk.ticks(5) == 4
    assert desk.command is None
    desk.tick(send=True)
    assert desk.command is not None


def test_somebody_else_who_sends_damps_the_motors(desk: Desk) -> None:
    desk.ticks(5, send=True)
    desk.robot.intrude(there=True)
    desk.robot.intrude(there=True)  # one is enough
    received = desk.robot.received
    desk.ticks(10)
    assert desk.robot.received == received + 10
    assert desk.command is not None
    np.testing.assert_array_equal(desk.command.kp, 0.0)
    np.testing.assert_array_equal(desk.command.tau, 0.0)
    np.testing.assert_array_equal(desk.command.kd, 2.0)
    # Whoever commands is answered: the bridge hears nothing while the other is alone.
    assert desk.ticks(10) == 0
    desk.robot.intrude(there=False)
    desk.tick(send=True)
    assert desk.ticks(10) == 10
    assert desk.robot.received == received + 21


def test_two_who_send_take_turns_at_the_motors(desk: Desk) -> None:
    desk.robot.intrude(there=True)
    driven = 0
    for _ in range(200):
        desk.tick(send=True)
        driven += desk.command is not None and bool(desk.command.kp.any())
    assert 50 < driven < 150


def test_all_is_well_again_when_it_is_cleared(desk: Desk) -> None:
    for fault in ("loss", "duplicate", "garbage"):
        desk.robot.disturb(fault, 0.5, (REPORTS, COMMANDS))
    desk.robot.condition.set_charge(8.0, 0)
    desk.robot.condition.press(frozenset({"L2", "B"}), None)
    desk.robot.intrude(there=True)
    desk.robot.switch(on=False)
    desk.robot.clear()
    desk.ticks(1, send=True)
    before = desk.driver.counters["received"]
    assert desk.ticks(20, send=True) == 20
    assert desk.driver.counters["received"] == before + 20
    assert desk.robot.malformed == 0


def test_equal_seeds_lose_equal_packets() -> None:
    arrivals = []
    for _ in range(2):
        desk = Desk()
        desk.robot.disturb("loss", 0.3, (REPORTS,))
        arrivals.append([desk.tick() is not None for _ in range(100)])
        desk.driver.close()
        desk.robot.close()
    assert arrivals[0] == arrivals[1]
    assert 0 < sum(arrivals[0]) < 100
