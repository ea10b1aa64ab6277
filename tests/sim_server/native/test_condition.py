"""What a robot says of itself beside its mechanics: counter, battery, remote control, motors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.shared.config.load import load
from quadriga.shared.robot.conventions import JOINT_NAMES
from quadriga.shared.unitree.packets import OFF, PROTECTED, SERVO, RobotReport
from quadriga.shared.unitree.remote import read_remote
from quadriga.shared.wire.messages import State
from quadriga.sim_server.native.condition import FULL, RobotCondition
from quadriga.sim_server.world.world import World
from tests.bridges.robots import config_of, holding

STATE = World(load(overrides={"team.robots": 1})).states()["r1"]
COLD = np.zeros(12)


def at(tick: int) -> State:
    return replace(STATE, tick=tick)


def report(condition: RobotCondition, tick: int) -> RobotReport:
    return condition.report(at(tick), COLD, holding(config_of()))


def test_its_counter_begins_anywhere_and_counts_milliseconds() -> None:
    firsts = {report(RobotCondition((seed,)), 0).tick for seed in range(20)}
    assert len(firsts) == 20
    condition = RobotCondition((1,))
    first = report(condition, 0).tick
    assert [(report(condition, k).tick - first) % 2**32 for k in (1, 5, 10_000)] == [1, 5, 10_000]


def test_a_robot_that_is_switched_on_again_counts_anew() -> None:
    condition = RobotCondition((1,))
    condition.switch_on(500)  # it is on: nothing happens
    assert report(condition, 500).tick != 0
    condition.off = True
    condition.switch_on(600)
    assert not condition.off
    assert report(condition, 607).tick == 7


def test_its_battery_drains_slowly_from_what_it_is_given() -> None:
    condition = RobotCondition((1,))
    charges = []
    for tick in range(0, 3_600_001, 60_000):
        battery = report(condition, tick).battery
        assert battery is not None
        assert battery.voltage is not None
        charges.append(battery.charge)
    assert charges[0] == FULL
    assert charges[-1] == FULL - 60, "1 % in a minute"
    assert charges == sorted(charges, reverse=True)
    condition.set_charge(8.0, 3_600_000)
    battery = report(condition, 3_600_001).battery
    assert battery is not None
    assert battery.charge == 8
    empty = report(condition, 10_000_000).battery
    assert empty is not None
    assert empty.charge == 0


def test_buttons_are_let_go_of_at_their_time() -> None:
    condition = RobotCondition((1,))
    idle = read_remote(report(condition, 0).remote)
    assert idle.on
    assert not idle.pressed
    condition.press(frozenset({"L2", "B"}), until=700)
    assert read_remote(report(condition, 699).remote).pressed == {"L2", "B"}
    assert not read_remote(report(condition, 700).remote).pressed
    condition.press(frozenset({"A"}), None)
    assert read_remote(report(condition, 10**6).remote).pressed == {"A"}
    condition.switch_remote_off()
    assert report(condition, 10**6).remote == bytes(40)


def test_a_motor_in_protection_mode_says_so_and_gives_nothing_until_it_is_cleared() -> None:
    condition, targets = RobotCondition((1,)), holding(config_of(), tau=np.ones(12))
    joint = JOINT_NAMES.index("FR_calf_joint")
    condition.protect(joint)
    said = condition.report(at(0), COLD, targets)
    assert said.mode[joint] == PROTECTED
    assert set(np.delete(said.mode, joint).tolist()) == {SERVO}
    assert targets.mode[joint] == SERVO, "the command itself is left alone"
    command = condition.command(targets)
    assert command is not None
    for values in (command.tau, command.kp, command.kd):
        assert values[joint] == 0.0
        assert np.delete(values, joint).all()
    condition.clear(1)
    assert condition.report(at(1), COLD, targets).mode[joint] == SERVO
    command = condition.command(targets)
    assert command is not None
    assert command.kp.all()


def test_a_robot_that_is_off_commands_nothing() -> None:
    condition, targets = RobotCondition((1,)), holding(config_of())
    assert condition.command(targets) is not None
    assert condition.command(None) is None
    assert condition.command(replace(targets, mode=np.full(12, OFF, np.uint8))) is None
    condition.off = True
    assert condition.command(targets) is None


def test_its_motors_lose_a_packet_now_and_then() -> None:
    condition = RobotCondition((1,))
    lost = np.array([report(condition, tick).lost for tick in range(0, 600_000, 1000)])
    assert (np.diff(lost, axis=0) >= 0).all()
    assert lost[-1].mean() == pytest.approx(0.05 * 600, rel=0.3)
