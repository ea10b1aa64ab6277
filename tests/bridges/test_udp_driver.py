"""A driver on real sockets, against a robot and against a noisy network."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from quadriga.bridges.drivers import UdpDriver
from quadriga.bridges.plant import RobotPlant
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError, CheckError, ConfigError
from quadriga.shared.unitree.codecs import A1, GO1
from quadriga.shared.unitree.packets import OFF, SERVO
from quadriga.shared.unitree.udp import Address, UdpPort
from tests.bridges.robots import config_of, holding, standing

HOST = "127.0.0.1"


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])


class Link:
    """A driver of an A1, and the other end of its network."""

    def __init__(self) -> None:
        robot, listen = Address(HOST, free_port()), Address(HOST, free_port())
        self.robot = UdpPort(robot, listen)
        self.config = BridgeConfig(f"{HOST}:{robot.port}", f"{HOST}:{listen.port}")
        self.driver = UdpDriver("a1", self.config)

    def report(self, tick: int) -> None:
        packet = A1.encode_report(replace(standing(config_of()), tick=tick))
        assert self.robot.send(packet)


@pytest.fixture
def link() -> Iterator[Link]:
    made = Link()
    yield made
    made.driver.close()
    made.robot.close()


def test_the_newest_report_counts(link: Link) -> None:
    assert link.driver.receive() is None
    for tick in (5, 6, 7):
        link.report(tick)
    report = link.driver.receive()
    assert report is not None
    assert report.tick == 7
    link.robot.close()
    for _ in range(3):  # a robot that is off costs no exception
        link.driver.send(holding(config_of()))
        assert link.driver.receive() is None
    counters = link.driver.counters
    assert (counters["received"], counters["sent"] + counters["unsent"]) == (3, 3)


def test_repeated_older_and_damaged_packets_are_noticed_and_not_used(link: Link) -> None:
    link.report(10)
    assert link.driver.receive() is not None
    link.report(10)
    link.report(9)
    link.robot.send(b"garbage")
    link.robot.send(GO1.encode_report(standing(config_of("go1"))))
    assert link.driver.receive() is None
    assert link.driver.counters == {"received": 1, "repeated": 1, "older": 1} | {
        "malformed": 2,
        "malformed_size": 2,
    }
    assert "got 807 bytes, expected 771" in link.driver.malformed


def test_a_robot_whose_packets_are_all_malformed_is_refused_with_their_reason(
    link: Link, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("_FIND_MS", "_LOOK_MS"):
        monkeypatch.setattr(f"quadriga.bridges.plant.{name}", 20)
    plant = RobotPlant(config_of(), "r1", link.driver, watchdog=None, say=list[str]().append)
    for _ in range(3):
        link.robot.send(b"garbage")
    expected = r"reports: got 0 .*\(3 malformed, the last one report of the A1: size: got 7 bytes"
    with pytest.raises(CheckError, match=expected):
        plant.look(lambda: False)


def test_the_counter_may_wrap(link: Link) -> None:
    for tick in (2**32 - 1, 0):
        link.report(tick)
        report = link.driver.receive()
        assert report is not None
        assert report.tick == tick


def test_what_is_sent_arrives_as_a_command(link: Link) -> None:
    targets = holding(config_of(), tau=np.arange(12.0))
    link.driver.send(targets)
    ((packet, sender),) = link.robot.drain()
    read = A1.decode_command(packet)
    np.testing.assert_allclose(read.tau, targets.tau)
    assert set(read.mode.tolist()) == {SERVO}
    assert sender.host == HOST
    assert OFF not in read.mode


def test_a_port_in_use_and_a_wrong_address_are_one_clear_error(link: Link) -> None:
    with pytest.raises(BridgeError, match=r"UDP port \d+ of 127.0.0.1: got Address already in use"):
        UdpDriver("a1", link.config)
    for endpoint, listen, said in (
        ("robot", "", "bridge.endpoint: got 'robot', expected HOST:PORT"),
        ("a.invalid:1", "", "bridge.endpoint: got 'a.invalid:1': .*, expected a host"),
        (f"{70 * 'a'}:1", "", "expected a host that has an IPv4 address"),
        ("", "192.0.2.7:1", "of 192.0.2.7: got "),
    ):
        with pytest.raises((BridgeError, ConfigError), match=said):
            UdpDriver("a1", replace(link.config, endpoint=endpoint, listen=listen))
