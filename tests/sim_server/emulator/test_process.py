"""The process of the emulated robots: commands through a pipe, events, truth, and a harness."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.config.load import load
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import JOINT_NAMES, Array
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.unitree.codecs import A1
from quadriga.shared.unitree.packets import pressed_buttons
from quadriga.shared.unitree.udp import Address
from quadriga.sim_server.emulator.link import LinkFaults
from quadriga.sim_server.emulator.process import (
    DAMPED,
    DRIVEN,
    HUNG_HEIGHT,
    LASTS_MS,
    MOTORS_OFF,
    Harness,
    MotorEvents,
    describe_motors,
    execute,
    read_lines,
)
from quadriga.sim_server.emulator.robot_emulator import RobotEmulator, UdpEmulator
from quadriga.sim_server.world.world import World
from tests.bridges.test_udp_driver import HOST, free_port

WAIT = 60.0  # s
ZERO, ONES = np.zeros(12), np.ones(12)


@pytest.fixture
def robots() -> Iterator[dict[str, RobotEmulator]]:
    made: dict[str, RobotEmulator] = {
        n: UdpEmulator(A1, Address(HOST, free_port())) for n in ("r1", "r2")
    }
    yield made
    for robot in made.values():
        robot.close()


def test_each_command_does_what_it_says(robots: dict[str, RobotEmulator]) -> None:
    lines = [f"all {word} 0.5" for word in ("loss", "duplicate", "reorder", "garbage", "delay")]
    lines += ["r1 remote L2+B", "r1 battery 8", "r1 protect FR_calf_joint", "r1 writer"]
    assert [execute(line, robots) for line in lines] == lines
    for robot in robots.values():
        assert robot.inwards.faults == robot.outwards.faults == LinkFaults(0.5, 0.5, 0.5, 0.5, 0.5)
    status = robots["r1"].status
    assert pressed_buttons(status.remote) == {"L2", "B"}
    assert (status.charge, status.protected) == (8.0, {JOINT_NAMES.index("FR_calf_joint")})
    assert robots["r2"].status.charge == 80.0
    assert robots["r1"]._second_writer is not None
    execute("all clear", robots)
    assert robots["r1"].inwards.faults == LinkFaults()
    assert robots["r1"]._second_writer is None


WRONG = [
    "",
    "r1",
    "r3 clear",
    "r1 explode",
    "r1 loss",
    "r1 loss much",
    "r1 remote L9",
    "r1 clear 1 2",
]


@pytest.mark.parametrize("line", WRONG)
def test_a_wrong_line_is_answered_and_changes_nothing(
    robots: dict[str, RobotEmulator], line: str
) -> None:
    assert execute(line, robots).startswith(f"command: got {line!r}, expected")
    assert robots["r1"].inwards.faults == LinkFaults()


def test_lines_come_whole_however_they_are_cut() -> None:
    out, into = os.pipe()
    rest, got = bytearray(), list[str]()
    for part in (b"r1 lo", b"ss 0.1\n\n  r2 clear \n\xff", b"\n", b"r1"):
        os.write(into, part)
        got += read_lines(out, rest)
    os.close(into)
    os.close(out)
    assert got == ["r1 loss 0.1", "r2 clear", "\ufffd"]


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
        (motion(kd=ONES - ONE), ZERO, DAMPED),  # one motor protects itself
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
    config = load(
        overrides={"team.robots": 2, "team.robot": kind, "world.initial_posture": "lying"}
    )
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


def wait_for(words: str, file: Path) -> None:
    deadline = monotonic() + WAIT
    while words not in file.read_text(encoding="utf-8"):
        assert monotonic() < deadline, file.read_text(encoding="utf-8")
        sleep(0.01)


def test_it_takes_commands_while_it_runs_and_ends_with_all_written(tmp_path: Path) -> None:
    said, truth = tmp_path / "said.log", tmp_path / "truth.csv"
    command = [sys.executable, "-m", "quadriga", "sim", "--as", "a1", "--hung", "--robots", "1"]
    command += ["--truth", str(truth), "--set", f"bridge.endpoint={HOST}:{free_port()}"]
    command += ["--set", "runtime.priority=ordinary"]
    with (
        said.open("wb") as log,
        subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log) as process,
    ):
        assert process.stdin is not None
        wait_for("on the network", said)
        process.stdin.write(b"r1 explode\nr1 clear\n")
        process.stdin.close()
        wait_for("ms: r1 clear\n", said)
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT) == 0
    lines = said.read_text(encoding="utf-8").splitlines()
    assert "command: got 'r1 explode'" in lines[1]
    header, *rows = truth.read_text(encoding="utf-8").splitlines()
    assert header.startswith("ms,r1_x,r1_y,r1_z,")
    assert [int(row.split(",")[0]) for row in rows] == [10 * k for k in range(len(rows))]
    assert abs(float(rows[-1].split(",")[3]) - HUNG_HEIGHT) < 0.02
