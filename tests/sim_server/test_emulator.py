"""Emulated robots: an A1 as its driver sees it, what is told of motors, and the process."""

from __future__ import annotations

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadriga.bridges.drivers import UdpDriver
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.unitree.codecs import A1
from quadriga.shared.unitree.packets import NO_ANGLE, NO_RATE, OFF, RobotReport
from quadriga.shared.unitree.udp import Address, UdpPort
from quadriga.sim_server.emulator import (
    DAMPED,
    DRIVEN,
    HUNG_HEIGHT,
    LASTS_MS,
    MOTORS_OFF,
    Harness,
    MotorEvents,
    UdpEmulator,
    describe_motors,
    open_emulators,
)
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding
from tests.bridges.test_udp_driver import HOST, free_port

WAIT = 60.0  # s
ZERO, ONES = np.zeros(12), np.ones(12)
STATE = World(load(overrides={"team.robots": 1})).states()["r1"]
DRIVING = holding(config_of(), tau=np.arange(12.0))


def test_it_reports_once_it_has_heard_and_obeys_the_last_command_until_another_comes() -> None:
    here, listen = Address(HOST, free_port()), Address(HOST, free_port())
    robot = UdpEmulator(A1, here)
    driver = UdpDriver("a1", BridgeConfig(f"{HOST}:{here.port}", f"{HOST}:{listen.port}"))

    def tick(now: int) -> tuple[RobotReport | None, Command | None]:
        robot.report(replace(STATE, tick=now), ZERO + 0.5)
        return driver.receive(), robot.obey()

    assert [tick(now) for now in range(5)] == [(None, None)] * 5
    driver.introduce()
    assert tick(5) == (None, None), "that enables no motor"
    report, _ = tick(6)
    assert report is not None
    np.testing.assert_allclose(report.q, STATE.q_joint, atol=1e-6)
    np.testing.assert_allclose(report.accel, STATE.imu_accel, atol=1e-5)
    np.testing.assert_allclose(report.quat_wxyz, STATE.imu_quat_wxyz, atol=1e-6)
    np.testing.assert_allclose(report.foot, np.rint(STATE.foot_force))
    np.testing.assert_allclose(report.temperature, 50.0)
    driver.send(DRIVING)
    for now in range(7, 107):  # it has no watchdog
        report, command = tick(now)
        assert report is not None
        assert command is not None
        np.testing.assert_allclose(command.tau, np.arange(12.0))
    other = UdpPort(Address(HOST, 0), here)
    other.send(b"garbage")
    other.send(A1.encode_command(replace(DRIVING, tau=ONES)))
    _, command = tick(107)
    assert command is not None
    np.testing.assert_allclose(command.tau, 1.0)
    assert (robot.received, robot.malformed) == (3, 1)
    other.send(
        A1.encode_command(replace(DRIVING, q=ZERO + NO_ANGLE, dq=ZERO + NO_RATE, kp=ZERO, kd=ZERO))
    )
    _, command = tick(107)
    assert command is not None
    np.testing.assert_array_equal([command.q_des, command.v_des], 0.0)
    driver.send(replace(DRIVING, mode=np.full(12, OFF, np.uint8)))
    assert tick(108)[1] is None
    for end in (other, driver, robot):
        end.close()


def test_each_robot_may_have_a_network_of_its_own_and_then_domain_0_like_a_real_one() -> None:
    keys = {"team.robot": "go2", "team.robots": 2}
    config = load(overrides={**keys, "bridge.interface": "nowhere{number}"})
    ways = [config.bridge.of_robot(name) for name in ("r1", "r2")]
    assert [(way.interface, way.domain) for way in ways] == [("nowhere1", 0), ("nowhere2", 0)]
    with pytest.raises(BridgeError, match="DDS domain 0 on 'nowhere1'"):
        open_emulators(config)
    config = load(overrides={**keys, "bridge.interface": "lo", "bridge.domain": 186})
    ways = [config.bridge.of_robot(name) for name in ("r1", "r2")]
    assert [(way.interface, way.domain) for way in ways] == [("lo", 186), ("lo", 187)]


def test_what_is_open_is_closed_if_another_cannot_be_opened_or_has_no_address() -> None:
    port = free_port()
    keys = {"team.robots": 2, "bridge.endpoint": f"{HOST}:{port}"}  # the same for both
    for _ in range(2):  # the first robot's port is free again
        with pytest.raises(BridgeError, match=f"UDP port {port} of {HOST}"):
            open_emulators(load(overrides=keys))
    with pytest.raises(ConfigError, match=r"bridge\.endpoint"):
        open_emulators(load(overrides={"team.robots": 1}))


def motion(tau: Array = ZERO, kp: Array = ZERO, kd: Array = ZERO) -> Command:
    return Command(0, 0, tau, ZERO, ZERO, kp, kd)


RATES = np.linspace(-10.0, 10.0, 12)
ONE = np.eye(12)[3]


@pytest.mark.parametrize(
    ("command", "rates", "doing"),
    [
        (None, RATES, MOTORS_OFF),
        (motion(), RATES, MOTORS_OFF),
        (motion(kd=3.0 * ONES), RATES, DAMPED),
        (motion(tau=3.0 * RATES, kd=3.0 * ONES), RATES, DAMPED),  # a bridge that limits torques
        (motion(kd=ONES - ONE), ZERO, DAMPED),
        (motion(tau=5.0 * ONES), ZERO, DRIVEN),
        (motion(tau=8.0 * ONES, kd=3.0 * ONES), ZERO, DRIVEN),
        (motion(kp=80.0 * ONE, kd=ONES), ZERO, DRIVEN),
        (motion(tau=5.0 * ONE, kd=ONES - ONE), ZERO, DRIVEN),
    ],
)
def test_motors_are_damped_if_they_only_brake(
    command: Command | None, rates: Array, doing: str
) -> None:
    assert describe_motors(command, rates) == doing


def test_what_lasts_is_told_with_the_tick_at_which_it_began() -> None:
    events, told = MotorEvents(), list[tuple[int, str]]()
    doings = [MOTORS_OFF] * 30 + [DRIVEN] * 100 + [DAMPED, DRIVEN] * 50 + [DAMPED] * 100
    for now, doing in enumerate(doings):
        if (since := events.update(now, doing)) is not None:
            told.append((since, doing))
            assert now == since + LASTS_MS
    assert told == [(30, DRIVEN), (230, DAMPED)]


@pytest.mark.parametrize("kind", ["a1", "go1", "go2"])
def test_a_robot_that_hangs_stays_level_and_in_place_while_its_legs_move(kind: str) -> None:
    keys = {"team.robots": 2, "team.robot": kind, "world.initial_posture": "lying"}
    config = load(overrides=keys)
    world, stand = World(config), config.robot.q_stand
    harness = Harness(world)
    place = world.truth().base_pos.copy()
    np.testing.assert_allclose(place[:, 2], HUNG_HEIGHT)
    for tick in range(2000):
        swing = 0.3 * np.sin(2 * np.pi * 1.5e-3 * tick)
        swings = Command(0, 0, ZERO, stand + swing, ZERO, 60.0 * ONES, 2.0 * ONES)
        damped = motion(kd=5.0 * ONES)
        world.step(dict.fromkeys(world.names, swings if tick < 1000 else damped))
        state = world.states()["r1"]
        assert np.abs(state.imu_gyro).max() < 1.0, "as calm as a test of joints wants it"
        harness.hold()
        truth = world.truth()
        assert np.abs(truth.base_pos - place).max() < 1e-9
        assert not truth.grf.any(), "its feet are off the ground"
    assert np.linalg.norm(state.imu_accel) == pytest.approx(9.81, abs=0.5)


def test_the_process_is_on_the_network_until_it_is_told_to_end(tmp_path: Path) -> None:
    said, port = tmp_path / "said.log", free_port()
    command = [sys.executable, "-m", "quadriga", "sim", "--as", "a1", "--hung", "--robots", "1"]
    command += ["--set", f"bridge.endpoint={HOST}:{port}", "--set", "runtime.priority=ordinary"]
    driver = UdpDriver("a1", BridgeConfig(f"{HOST}:{port}", f"{HOST}:{free_port()}"))
    with said.open("wb") as log, subprocess.Popen(command, stderr=log) as process:
        deadline, report = monotonic() + WAIT, None
        while report is None:
            assert monotonic() < deadline, said.read_text(encoding="utf-8")
            driver.introduce()
            sleep(0.01)
            report = driver.receive()
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT) == 0
    driver.close()
    lines = said.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "1 simulated Unitree A1 on the network"
    assert " ms: end, " in lines[-1]
