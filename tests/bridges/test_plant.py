"""The plant of one robot, with drivers that need no network."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from quadriga.bridges.drivers import RobotDriver
from quadriga.bridges.plant import RobotPlant, to_state, yaw_of
from quadriga.bridges.postures import passive
from quadriga.bridges.supervisor import BridgeMode, Request
from quadriga.bridges.watchdog import Watchdog
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import CheckError
from quadriga.shared.messages import Command, Event
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.unitree.packets import OFF, SERVO, MotorTargets, RobotReport
from tests.bridges.robots import config_of, standing, tilted


class Shy(RobotDriver):
    """A robot of one posture that says nothing before it has had a packet, and keeps what it gets.

    Every other time that it is asked it has something new to say.
    """

    servo, packets_ms = SERVO, 1

    def __init__(self, report: RobotReport) -> None:
        super().__init__()
        self._report, self._asked = report, 0
        self.commands: list[MotorTargets] = []

    def receive(self) -> RobotReport | None:
        self._asked += 1
        if not self.commands or self._asked % 2:
            return None
        self.counters["received"] += 1
        return replace(self._report, tick=self._asked)

    def introduce(self) -> None:
        self.send(passive(np.zeros(12)))

    def send(self, targets: MotorTargets) -> None:
        self.commands.append(targets)

    def close(self) -> None: ...


def test_a_dry_run_enables_no_motor_whatever_the_agent_asks_for() -> None:
    """Its robot says nothing before it has had a packet: it gets one, and no other."""
    config, said, states = config_of(report_share=0.05), list[str](), 0
    robot = Shy(standing(config, q=config.robot.q_lying))
    plant = RobotPlant(config, "r1", robot, watchdog=None, say=said.append)
    assert plant.prepare(lambda: False)
    for _ in range(200):
        states += len(plant.states())
        plant.step({"r1": Command(0, 0, *np.full((5, 12), 3.0))})
    plant.finish()
    assert [set(command.mode.tolist()) for command in robot.commands] == [{OFF}]
    assert plant.mode is BridgeMode.DRY
    assert states > 50
    assert "r1: dry run, no motor is enabled; --armed commands the robot" in said


def test_a_hot_motor_is_told_of_once_a_minute_and_recorded() -> None:
    config, said = config_of("go2"), list[str]()
    report = standing(config, temperature=np.where(np.arange(12) == 2, 82.0, 40.0))
    driver: Any = SimpleNamespace(
        servo=SERVO, period_ms=1, receive=lambda: report, other_writers=lambda: 0
    )
    plant, events = RobotPlant(config, "r1", driver, watchdog=None, say=said.append), list[Event]()
    plant.listen(str, events.append)
    for _ in range(3000):
        plant.turn(Request.REST)
    hot = "hot:FL_calf_joint 82 °C, 88 °C stop it"
    assert said == [f"r1: dry {hot}"]
    assert [(each.tick, each.robot, each.detail) for each in events] == [(0, "r1", f"dry {hot}")]


def test_a_robot_that_is_not_as_it_must_be_gets_no_command() -> None:
    """This one reports that it lies on its back, and its bridge is armed."""
    config = config_of(report_share=0.05)
    robot = Shy(standing(config, quat_wxyz=tilted(3.1), accel=np.array([0.0, 0.0, -9.81])))
    plant = RobotPlant(config, "r1", robot, watchdog=MagicMock(), say=print)
    with pytest.raises(CheckError, match=r"robot r1: posture: got tilted by 3\.10 rad"):
        plant.look(lambda: False)
    plant.finish()
    assert [set(command.mode.tolist()) for command in robot.commands] == [{OFF}]


def test_a_bridge_that_was_silent_learns_at_once_that_its_watchdog_has_acted() -> None:
    watchdog = Watchdog("a1", replace(config_of().bridge, damp_ms=20, passive_s=0.5))
    assert watchdog.beat()
    sleep(0.2)
    assert not watchdog.beat()
    assert watchdog._process.poll() is None, "it damps the motors"
    watchdog.dismiss()


class Script(RobotDriver):
    """A driver whose robot speaks at given milliseconds of the bridge."""

    servo, packets_ms = SERVO, 2

    def __init__(self, speaks: Iterator[bool]) -> None:
        super().__init__()
        self._speaks, self.ms, self._spoken = speaks, 0, False

    def pass_ms(self) -> None:
        """Let a millisecond pass.

        Raises:
            StopIteration: the script is at its end.
        """
        self.ms, self._spoken = self.ms + 1, next(self._speaks) or self._spoken

    def receive(self) -> RobotReport | None:
        spoken, self._spoken = self._spoken, False
        return standing(config_of(), tick=self.ms) if spoken else None

    def send(self, targets: MotorTargets) -> None:
        raise AssertionError("a dry run")

    def close(self) -> None: ...


def ticks_of(speaks: Iterable[bool]) -> list[int]:
    """Ticks of the states of a robot that speaks so."""
    script = Script(iter(speaks))
    plant = RobotPlant(config_of(), "r1", script, watchdog=None, say=list[str]().append)
    ticks = []
    with suppress(StopIteration):
        while True:
            ticks += [state.tick for state in plant.states().values()]
            script.pass_ms()
            plant.step({})
    return ticks


def test_states_have_even_ticks_and_each_sample_has_one() -> None:
    assert ticks_of(k % 2 == 0 for k in range(40)) == list(range(2, 41, 2))
    late = [True, *[False] * 4, True, *[False] * 10]
    assert ticks_of(late * 3) == [2, 6, 10, 18, 20, 22, 34, 38, 40]
    # At a sample without anything new the last report counts, unless it is old.
    assert ticks_of(k == 5 for k in range(25)) == [6, 10]
    assert ticks_of(k == 3 for k in range(25)) == [4]


def test_headings_count_from_where_the_robot_starts() -> None:
    config: Config = config_of()
    turned = np.array([np.cos(0.7), 0.0, 0.0, np.sin(0.7)])
    report = standing(config, quat_wxyz=turned)
    yaw = yaw_of(turned)
    assert yaw == pytest.approx(1.4)
    np.testing.assert_allclose(to_state(report, 4, yaw).imu_quat_wxyz, [1, 0, 0, 0], atol=1e-12)
    rolled = to_state(replace(report, quat_wxyz=tilted(0.3)), 4, 0.0)
    np.testing.assert_allclose(rolled.imu_quat_wxyz, tilted(0.3))
