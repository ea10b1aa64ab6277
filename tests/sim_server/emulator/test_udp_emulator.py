"""An emulated A1 and what befalls its network, as a bridge's driver sees it over real sockets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from quadriga.bridges.drivers import UdpDriver
from quadriga.bridges.plant import bridge_of
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import JOINT_NAMES
from quadriga.shared.unitree.codecs import A1
from quadriga.shared.unitree.packets import NO_ANGLE, NO_RATE, OFF, PROTECTED, SERVO, RobotReport
from quadriga.shared.unitree.udp import Address
from quadriga.sim_server.emulator.link import LinkFaults
from quadriga.sim_server.emulator.robot_emulator import RobotStatus, UdpEmulator, open_emulators
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding
from tests.bridges.test_udp_driver import HOST, free_port

STATE = World(load(overrides={"team.robots": 1})).states()["r1"]
COLD = np.zeros(12)
DRIVING = holding(config_of(), tau=np.arange(12.0))


class Bench:
    """A robot and a bridge's driver, a millisecond at a time."""

    def __init__(self) -> None:
        robot, listen = Address(HOST, free_port()), Address(HOST, free_port())
        self.robot = UdpEmulator(A1, robot, seed=(5,))
        self.driver = UdpDriver("a1", BridgeConfig(f"{HOST}:{robot.port}", f"{HOST}:{listen.port}"))
        self.now = 0
        self.command: Command | None = None

    def tick(self, *, send: bool = False) -> RobotReport | None:
        """The robot reports, the bridge receives and may send, the robot obeys."""
        self.robot.report(replace(STATE, tick=self.now), COLD + 0.5)
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
def silent() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.driver.close()
    made.robot.close()


@pytest.fixture
def bench(silent: Bench) -> Bench:
    """One that has had a packet, and so reports."""
    silent.driver.introduce()
    silent.robot.obey()
    silent.robot.received = 0
    return silent


def test_it_reports_what_its_sensors_measure_once_it_has_heard(silent: Bench) -> None:
    assert silent.ticks(5) == 0
    silent.driver.introduce()
    assert silent.tick() is None
    assert silent.command is None, "that enables no motor"
    report = silent.tick()
    assert report is not None
    np.testing.assert_allclose(report.q, STATE.q_joint, atol=1e-6)
    np.testing.assert_allclose(report.accel, STATE.imu_accel, atol=1e-5)
    np.testing.assert_allclose(report.quat_wxyz, STATE.imu_quat_wxyz, atol=1e-6)
    np.testing.assert_allclose(report.foot, np.rint(STATE.foot_force))
    np.testing.assert_allclose(report.temperature, 50.0)


def test_it_obeys_the_last_command_until_another_comes(bench: Bench) -> None:
    bench.tick(send=True)
    bench.ticks(100)  # it has no watchdog
    assert bench.command is not None
    np.testing.assert_allclose(bench.command.tau, np.arange(12.0))
    bench.driver.send(replace(DRIVING, mode=np.full(12, OFF, np.uint8)))
    bench.tick()
    assert bench.command is None


NO, LOST, LATE = LinkFaults(), LinkFaults(loss=1.0), LinkFaults(delay=5.0)


@pytest.mark.parametrize(
    ("inwards", "outwards", "reports", "commands", "counters"),
    [
        (LOST, NO, 20, 0, {}),
        (NO, LOST, 0, 20, {}),
        (LATE, LATE, 15, 15, {}),
        (NO, LinkFaults(duplicate=1.0), 20, 20, {"repeated": 20}),
        (NO, LinkFaults(reorder=1.0), 10, 20, {"older": 10}),
        (LinkFaults(garbage=1.0), LinkFaults(garbage=1.0), 0, 0, {"malformed": 20}),
    ],
)
def test_what_happens_on_each_way_is_what_both_ends_count(
    bench: Bench,
    inwards: LinkFaults,
    outwards: LinkFaults,
    reports: int,
    commands: int,
    counters: dict[str, int],
) -> None:
    bench.robot.inwards.faults, bench.robot.outwards.faults = inwards, outwards
    assert bench.ticks(20, send=True) == reports
    assert bench.robot.received == commands
    assert {name: bench.driver.counters[name] for name in counters} == counters
    assert bench.robot.malformed == counters.get("malformed", 0)


def test_two_writers_take_turns_at_the_motors_until_one_leaves(bench: Bench) -> None:
    bench.robot.add_second_writer()
    bench.robot.add_second_writer()  # one is enough
    bench.robot.status.charge, driven = 8.0, 0
    for _ in range(200):
        bench.tick(send=True)
        assert bench.command is not None
        driven += bool(bench.command.kp.any())
    assert 50 < driven < 150
    bench.ticks(10)
    assert bench.command is not None
    assert not bench.command.kp.any()
    assert not bench.command.tau.any()
    np.testing.assert_array_equal(bench.command.kd, 2.0)
    bench.robot.inwards.faults = bench.robot.outwards.faults = LinkFaults(0.5, 0.5, 0.5, 0.5)
    bench.ticks(20, send=True)
    bench.robot.clear()
    bench.tick(send=True)
    assert bench.ticks(20, send=True) == 20, "all is well again"
    assert bench.robot.status.charge == 80.0
    assert bench.command.kp.all()


def test_a_motor_in_protection_mode_says_so_and_gives_nothing() -> None:
    joint = JOINT_NAMES.index("FR_calf_joint")
    status, targets = RobotStatus(protected={joint}), holding(config_of(), tau=np.ones(12))
    mode = status.report(STATE, COLD, targets).mode
    assert mode[joint] == PROTECTED
    assert set(np.delete(mode, joint).tolist()) == {SERVO}
    assert targets.mode[joint] == SERVO, "the command itself is left alone"
    command = status.command(targets)
    assert command is not None
    for values in (command.tau, command.kp, command.kd):
        assert values[joint] == 0.0
        assert np.delete(values, joint).all()
    nothing = {"q": np.full(12, NO_ANGLE), "dq": np.full(12, NO_RATE)}
    free = RobotStatus().command(holding(config_of(), kp=COLD, kd=COLD, tau=COLD + 1.0, **nothing))
    assert free is not None
    np.testing.assert_array_equal([free.q_des, free.v_des], 0.0)


def test_each_robot_may_have_a_network_of_its_own_and_then_domain_0_like_a_real_one() -> None:
    keys = {"team.robot": "go2", "team.robots": 2}
    config = load(overrides={**keys, "bridge.interface": "nowhere{number}"})
    ways = [bridge_of(config, name) for name in ("r1", "r2")]
    assert [(way.interface, way.domain) for way in ways] == [("nowhere1", 0), ("nowhere2", 0)]
    with pytest.raises(BridgeError, match="DDS domain 0 on 'nowhere1'"):
        open_emulators(config)
    config = load(overrides={**keys, "bridge.interface": "lo", "bridge.domain": 186})
    ways = [bridge_of(config, name) for name in ("r1", "r2")]
    assert [(way.interface, way.domain) for way in ways] == [("lo", 186), ("lo", 187)]


def test_what_is_open_is_closed_if_another_cannot_be_opened_or_has_no_address() -> None:
    port = free_port()
    keys = {"team.robots": 2, "bridge.endpoint": f"{HOST}:{port}"}  # the same for both
    for _ in range(2):  # the first robot's port is free again
        with pytest.raises(BridgeError, match=f"UDP port {port} of {HOST}"):
            open_emulators(load(overrides=keys))
    with pytest.raises(ConfigError, match=r"bridge\.endpoint"):
        open_emulators(load(overrides={"team.robots": 1}))
