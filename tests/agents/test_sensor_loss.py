"""A robot that walks, and whose IMU or encoder fails: it does not fall."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.controller.maths.rows import row_size
from quadriga.agents.encoder_bridge import ENCODERS
from quadriga.agents.sensor_loss import SensorLosses
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.load import load
from quadriga.shared.robot.conventions import JOINT_NAMES
from quadriga.team.operator import references_of

FAILS = 2000  # tick


def walk_with(
    fault: str, until: int, robots: int = 1, seed: int = 52
) -> tuple[list[tuple[str, str]], tuple[str, ...]]:
    """Modes of the first robot in their order, and who fell."""
    given = {"team.robots": robots, "planner.kind": "none", "world.seed": seed}
    config = load(None, given | {"world.faults": f"r1/{fault}"})
    rollout = Rollout(config, None, references_of(config))
    modes = list[tuple[str, str]]()
    for tick in rollout.ticks(until):
        mode = tick.outputs["r1"].mode, tick.outputs["r1"].reason
        if mode not in modes:
            modes.append(mode)
    return modes, rollout.world.fallen()


@pytest.mark.parametrize("kind", ["off", "garbage", "wrong", "stuck"])
def test_half_a_second_without_an_imu_is_no_fall(kind: str) -> None:
    modes, fallen = walk_with(f"imu {kind} {1e-3 * FAILS:g} 0.5", FAILS + 3000)
    assert fallen == ()
    assert modes[-1] == ("stand", "imu-lost")


@pytest.mark.parametrize("kind", ["off", "stuck"])
def test_yoked_robots_walk_on_without_the_imu_of_one_for_half_a_second(kind: str) -> None:
    modes, fallen = walk_with(f"imu {kind} {1e-3 * FAILS:g} 0.5", FAILS + 2500, 2, seed=61)
    assert fallen == ()
    assert modes == [("stand", ""), ("walk", "")]


@pytest.mark.parametrize("robots", [1, 2])
def test_a_robot_does_not_fall_whose_imu_is_late_for_good(robots: int) -> None:
    modes, fallen = walk_with(f"imu delayed {1e-3 * FAILS:g}", FAILS + 4000, robots)
    assert fallen == ()
    assert modes[-1] == ("stand", "imu-lost")


def test_without_an_imu_for_good_a_robot_holds_its_joints() -> None:
    modes, fallen = walk_with(f"imu off {1e-3 * FAILS:g}", FAILS + 4000)
    assert fallen == ()
    assert modes[-1] == ("stand", "imu-lost")


@pytest.mark.parametrize("kind", ["off", "garbage", "wrong", "stuck"])
def test_half_a_second_without_an_accelerometer_stops_nobody(kind: str) -> None:
    modes, fallen = walk_with(f"accel {kind} {1e-3 * FAILS:g} 0.5", FAILS + 2000)
    assert fallen == ()
    assert modes[-1] == ("walk", "")


@pytest.mark.parametrize("kind", ["off", "garbage"])
def test_half_a_second_without_a_knees_encoder_stops_nobody(kind: str) -> None:
    fault = f"encoder_FL_calf {kind} {1e-3 * FAILS:g} 0.5"
    modes, fallen = walk_with(fault, FAILS + 2500, 2, seed=61)
    assert fallen == ()
    assert modes == [("stand", ""), ("walk", "")]


@pytest.mark.parametrize("kind", ["off", "garbage", "wrong"])
@pytest.mark.parametrize("joint", ["FL_calf", "RR_thigh", "FR_hip"])
def test_a_robot_alone_stands_without_the_encoder_of_a_joint_for_good(
    joint: str, kind: str
) -> None:
    modes, fallen = walk_with(f"encoder_{joint} {kind} {1e-3 * FAILS:g}", FAILS + 3000)
    assert fallen == ()
    if (joint, kind) == ("FR_hip", "off"):  # that reads 0, which is where a hip is
        assert modes[-1] == ("walk", "")
    else:
        assert modes[-1] == ("stand", f"encoder-lost:{joint}")


@pytest.mark.parametrize("part", ["hip", "thigh", "calf"])
@pytest.mark.parametrize("yoked", [True, False])
def test_a_yoked_robot_does_without_a_knee_for_longer_than_without_a_thigh(
    part: str, yoked: bool
) -> None:
    losses, joint = SensorLosses(yoked=yoked), JOINT_NAMES.index(f"RR_{part}_joint")
    longest = {"hip": 800, "thigh": 300, "calf": 800}[part] if yoked else 100
    for held_ms in (longest - 1, longest + 1):
        row = np.zeros(row_size(ENCODERS))
        row[ENCODERS.held][joint] = row[ENCODERS.longest] = 1e-3 * held_ms
        loss = losses.find(0.0, row)
        assert loss.reason == ("" if held_ms < longest else f"encoder-lost:RR_{part}")
        assert loss.joints == (joint,)
        assert loss.now is (held_ms > longest)
