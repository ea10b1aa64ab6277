"""The board of a simulated robot: it reports, and obeys the last command for ever."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from quadriga.bridges.postures import passive
from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.shared.unitree.packets import NO_ANGLE, NO_RATE, OFF, PacketError
from quadriga.shared.unitree.udp import A1
from quadriga.shared.unitree.udp_port import Address, UdpPort
from quadriga.sim_server.native.open_boards import open_boards
from quadriga.sim_server.native.udp_robot import UdpRobot
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding
from tests.bridges.test_udp_driver import HOST, free_port


@pytest.fixture
def ends() -> Iterator[tuple[UdpRobot, UdpPort]]:
    here, listener = Address(HOST, free_port()), Address(HOST, free_port())
    robot, bridge = UdpRobot(A1, here), UdpPort(listener, here)
    yield robot, bridge
    robot.close()
    bridge.close()


def test_it_reports_what_its_sensors_measure_once_it_has_heard(
    ends: tuple[UdpRobot, UdpPort],
) -> None:
    robot, bridge = ends
    state = World(load(overrides={"team.robots": 1})).states()["r1"]
    robot.report(state, np.full(12, 0.5))
    assert list(bridge.drain()) == []
    bridge.send(A1.encode_command(passive(np.zeros(12))))
    assert robot.obey() is None, "that enables no motor"
    robot.report(state, np.full(12, 0.5))
    ((packet, _),) = bridge.drain()
    report = A1.decode_report(packet)
    np.testing.assert_allclose(report.q, state.q_joint, atol=1e-6)
    np.testing.assert_allclose(report.accel, state.imu_accel, atol=1e-5)
    np.testing.assert_allclose(report.quat_wxyz, state.imu_quat_wxyz, atol=1e-6)
    np.testing.assert_allclose(report.foot, np.rint(state.foot_force))
    np.testing.assert_allclose(report.temperature, 50.0)


def test_without_a_command_its_motors_are_off(ends: tuple[UdpRobot, UdpPort]) -> None:
    assert ends[0].obey() is None


def test_it_obeys_the_last_command_until_another_comes(ends: tuple[UdpRobot, UdpPort]) -> None:
    robot, bridge = ends
    bridge.send(A1.encode_command(holding(config_of(), tau=np.arange(12.0))))
    for _ in range(3):  # it has no watchdog
        command = robot.obey()
        assert command is not None
        np.testing.assert_allclose(command.tau, np.arange(12.0))
    bridge.send(b"garbage")
    assert robot.obey() is not None
    assert (robot.malformed, robot.received) == (1, 1)
    off = holding(config_of(), mode=np.full(12, OFF, np.uint8))
    bridge.send(A1.encode_command(off))
    assert robot.obey() is None


def test_what_is_not_asked_for_is_not_an_angle(ends: tuple[UdpRobot, UdpPort]) -> None:
    robot, bridge = ends
    nothing = {"q": np.full(12, NO_ANGLE), "dq": np.full(12, NO_RATE)}
    free = holding(config_of(), kp=np.zeros(12), kd=np.zeros(12), tau=np.ones(12), **nothing)
    bridge.send(A1.encode_command(free))
    command = robot.obey()
    assert command is not None
    np.testing.assert_array_equal(command.q_des, 0.0)
    np.testing.assert_array_equal(command.v_des, 0.0)


def test_robots_without_an_address_of_their_own_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"bridge\.endpoint: got nothing"):
        open_boards(load(overrides={"team.robots": 1}))
    with pytest.raises(PacketError):
        A1.decode_command(b"")
