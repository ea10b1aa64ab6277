"""A robot that has been dropped stands up from where it lies, and lies down again, in MuJoCo."""

from __future__ import annotations

import pytest

from quadriga.bridges.supervisor import BridgeMode, Request
from tests.bridges.dropped import Robot, random_angles


@pytest.mark.parametrize(("kind", "seed"), [("a1", 104), ("go1", 101), ("go2", 103)])
def test_from_where_it_fell_it_stands_up_and_lies_down_gently(kind: str, seed: int) -> None:
    robot = Robot(kind)
    robot.drop(random_angles(kind, seed))
    up = robot.stand()
    spec = robot.config.robot
    assert robot.state.reason == ""
    assert robot.torque <= 1.0
    assert up[-1].height == pytest.approx(spec.stand_height, rel=0.1)
    assert up[-1].tilt < 0.1
    down = list(robot.do(Request.LIE, BridgeMode.PASSIVE))
    assert robot.state.reason == ""
    assert max(moment.falling for moment in down) < 0.3
    assert down[-1].height < 0.6 * spec.stand_height


def test_a_robot_that_stands_does_not_lie_down_to_stand_up() -> None:
    robot = Robot("a1")  # it spawns standing
    heights = [moment.height for moment in robot.stand()]
    assert min(heights) > 0.85 * robot.config.robot.stand_height


def test_standing_up_that_is_broken_off_goes_down_from_where_it_is() -> None:
    robot = Robot("a1")
    robot.drop(robot.config.robot.q_lying)
    for moment in robot.do(Request.STAND, BridgeMode.STAND):
        if moment.height > 0.18:
            break
    down = list(robot.do(Request.LIE, BridgeMode.PASSIVE))
    assert robot.state.reason == ""
    assert max(moment.height for moment in down) < 0.22
    assert max(moment.falling for moment in down) < 0.3
