"""Orders carried out at their time, said with their tick, and wrong ones that change nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from quadriga.bridges.postures import passive
from quadriga.shared.config.load import load
from quadriga.shared.unitree.remote import read_remote
from quadriga.shared.unitree.udp import A1
from quadriga.shared.unitree.udp_port import Address, UdpPort
from quadriga.sim_server.native.hanger import Hanger
from quadriga.sim_server.native.orders import HELP, parse_order
from quadriga.sim_server.native.steering import Steering
from quadriga.sim_server.native.udp_robot import UdpRobot
from quadriga.sim_server.world.world import World
from tests.bridges.test_udp_driver import HOST, free_port

NAMES = ("r1", "r2")


class Typed:
    """Lines that somebody has typed."""

    def __init__(self) -> None:
        self.waiting = list[str]()

    def lines(self) -> list[str]:
        came, self.waiting = self.waiting, []
        return came


class Desk:
    """Two robots, their operator, and what is said to them."""

    def __init__(self, orders: Sequence[str] = ()) -> None:
        self.world = World(load(overrides={"team.robots": 2, "world.spawn": "lying"}))
        places = {name: Address(HOST, free_port()) for name in NAMES}
        self.bridges = {name: UdpPort(Address(HOST, free_port()), places[name]) for name in NAMES}
        self.robots = {name: UdpRobot(A1, place) for name, place in places.items()}
        for name, bridge in self.bridges.items():
            bridge.send(A1.encode_command(passive(np.zeros(12))))
            self.robots[name].obey()
        self.hanger, self.typed, self.said = Hanger(self.world), Typed(), list[str]()
        parsed = [parse_order(order, NAMES) for order in orders]
        self.steering = Steering(self.robots, self.hanger, self.typed, parsed, self.said.append)
        self.now = 0

    def turn(self, until: int) -> None:
        """Ticks up to this one, and the robots' reports."""
        state = self.world.states()["r1"]
        while self.now < until:
            self.steering.turn(self.now)
            for robot in self.robots.values():
                robot.report(replace(state, tick=self.now), np.zeros(12))
            self.now += 1

    def close(self) -> None:
        for robot in self.robots.values():
            robot.close()
        for bridge in self.bridges.values():
            bridge.close()


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk(["0.004 r1 battery 8", "r2 protect FR_calf_joint", "0.004 r1 battery 9"])
    yield made
    made.close()


def test_orders_from_the_start_come_at_their_time_and_in_their_order(desk: Desk) -> None:
    desk.turn(4)
    assert desk.said == ["0 ms: order r2 protect FR_calf_joint"]
    desk.turn(10)
    assert desk.said[1:] == ["4 ms: order r1 battery 8", "4 ms: order r1 battery 9"]


def test_typed_lines_are_looked_for_each_ten_milliseconds(desk: Desk) -> None:
    desk.turn(11)
    desk.said.clear()
    desk.typed.waiting = ["r1 remote L2+B", "all loss 0.2", "0.025 r2 off", "help", "mark here"]
    desk.turn(20)
    assert desk.said == []
    desk.turn(30)
    assert desk.said[:2] == ["20 ms: noted for 25 ms: r2 off", HELP]
    assert desk.said[2:4] == ["20 ms: order r1 remote L2+B", "20 ms: order all loss 0.2"]
    assert desk.said[4].startswith("20 ms: order mark here (clock ")
    assert desk.said[5:] == ["25 ms: order r2 off"]
    assert desk.robots["r2"].condition.off
    assert not desk.robots["r1"].condition.off


def test_buttons_are_pressed_for_half_a_second(desk: Desk) -> None:
    desk.typed.waiting = ["r1 remote L2+B"]
    pressed = []
    for until in range(1, 700):
        desk.turn(until)
        ((packet, _),) = desk.bridges["r1"].drain()
        pressed.append(bool(read_remote(A1.decode_report(packet).remote).pressed))
    changes = [k for k, (a, b) in enumerate(pairwise(pressed), start=1) if a != b]
    assert pressed[0]
    assert changes == [500]


def test_a_wrong_line_is_answered_and_changes_nothing(desk: Desk) -> None:
    desk.turn(11)
    desk.said.clear()
    desk.typed.waiting = ["r1 explode", "r1 loss 2"]
    desk.turn(30)
    assert len(desk.said) == 2
    assert desk.said[0].startswith("20 ms: order: got 'explode', expected r1 and one of loss")
    assert desk.said[1].startswith("20 ms: order: got 'loss 2', expected loss, a share of packets")


def test_robots_are_hung_and_let_down_and_cleared(desk: Desk) -> None:
    desk.typed.waiting = ["all hang", "r1 delay 20", "r1 writer"]
    desk.turn(1)
    assert set(desk.hanger.hung) == {"r1", "r2"}
    desk.typed.waiting = ["r2 lower", "all clear"]
    desk.turn(11)
    for _ in range(3000):
        desk.hanger.hold()
        desk.world.step({})
    assert set(desk.hanger.hung) == {"r1"}
    robot = desk.robots["r1"]
    for _ in desk.bridges["r1"].drain():
        pass
    desk.turn(20)
    robot.obey()
    before = robot.received
    desk.turn(40)
    robot.obey()
    assert robot.received == before, "nobody else sends to it"
