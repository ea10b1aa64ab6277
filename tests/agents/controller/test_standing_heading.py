"""The heading of a robot that stands, and what it learns of its IMU meanwhile."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.controller.maths.rotation import wrap_angle
from quadriga.agents.controller.memory import MEMORY, initial_memory
from quadriga.agents.controller.standing_heading import (
    DRIFT_KNOWN_S,
    DRIFT_MOST,
    FOLLOW_S,
    SETTLED_S,
    keep_heading,
)
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array
from quadriga.team.operator import references_of

DT = 1e-3
FEET = np.array([[0.18, 0.14, 0.0], [0.18, -0.14, 0.0], [-0.18, 0.14, 0.0], [-0.18, -0.14, 0.0]])


def turned(yaw: float) -> Array:
    """The feet of a robot that stands still, in an odometry frame that has drifted."""
    c, s = np.cos(yaw), np.sin(yaw)
    feet: Array = FEET @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return feet


def stand(memory: Array, seconds: float, rate: float, noise: float = 0.0) -> float:
    """Stand while the frame turns; how far it has turned in the end, rad."""
    chance = np.random.default_rng(1)
    ticks = round(seconds / DT)
    for tick in range(1, ticks + 1):
        feet = turned(rate * tick * DT) + noise * chance.standard_normal((4, 3))
        keep_heading(memory, True, feet, DT)
    return rate * ticks * DT


@pytest.fixture
def memory() -> Array:
    flat = initial_memory()
    flat[MEMORY.yaw_des] = 0.3
    return flat


def test_for_a_short_stand_the_heading_is_the_imus(memory: Array) -> None:
    stand(memory, SETTLED_S - 0.01, 0.1)
    assert memory[MEMORY.yaw_des] == 0.3


@pytest.mark.parametrize("rate", [-0.05, 0.002, 0.3])
def test_then_it_turns_with_the_feet_a_time_constant_behind(memory: Array, rate: float) -> None:
    stand(memory, SETTLED_S, rate)
    begun = rate * SETTLED_S
    angle = stand(memory, 60.0, rate) - begun  # the frame is turned back by the first stand
    expected = wrap_angle(0.3 + angle - rate * FOLLOW_S)
    assert wrap_angle(memory[MEMORY.yaw_des] - expected) == pytest.approx(0.0, abs=2e-3 * abs(rate))


def test_it_learns_the_drift_and_walks_on_with_it(memory: Array) -> None:
    stand(memory, DRIFT_KNOWN_S - 0.01, 0.004, noise=1e-3)
    assert memory[MEMORY.yaw_drift] == 0.0
    memory = initial_memory()
    stand(memory, DRIFT_KNOWN_S + 2.0, 0.004, noise=1e-3)
    assert memory[MEMORY.yaw_drift] == pytest.approx(0.004, abs=1e-4)
    before, drift = memory[MEMORY.yaw_des], memory[MEMORY.yaw_drift]
    for _ in range(1000):
        keep_heading(memory, False, FEET, DT)
    assert memory[MEMORY.yaw_des] - before == pytest.approx(drift)
    assert memory[MEMORY.stood_s] == 0.0


@pytest.mark.parametrize("turn", [0.5, -2.0])
def test_a_robot_that_is_turned_by_hand_does_not_take_that_for_drift(
    memory: Array, turn: float
) -> None:
    """The heading follows its feet; of the turn no more is averaged than what an IMU may do."""
    stand(memory, 20.0, 0.004)
    ticks, angle = 6000, 0.004 * 20.0
    for tick in range(1, ticks + 1):  # by hand, within two seconds, while the IMU drifts on
        angle += 0.004 * DT + (turn / 2000 if tick <= 2000 else 0.0)
        keep_heading(memory, True, turned(angle), DT)
    begun = 0.004 * SETTLED_S
    assert wrap_angle(memory[MEMORY.yaw_des] - 0.3 - angle + begun) == pytest.approx(0.0, abs=0.06)
    assert abs(memory[MEMORY.yaw_drift] - 0.004) < 2.0 * DRIFT_MOST * FOLLOW_S / 21.0
    assert abs(memory[MEMORY.yaw_drift]) <= DRIFT_MOST


def test_a_foot_in_the_air_begins_the_stand_anew(memory: Array) -> None:
    stand(memory, SETTLED_S - 0.1, 0.0)
    keep_heading(memory, False, FEET, DT)
    stand(memory, SETTLED_S - 0.1, 0.1)
    assert memory[MEMORY.yaw_des] == 0.3


def true_yaw(rollout: Rollout) -> float:
    w, x, y, z = np.asarray(rollout.world.truth().base_quat_wxyz).ravel()
    return float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def test_a_robot_stands_on_although_its_imu_turns() -> None:
    """It walked, and its operator left. A heading by the IMU would turn the trunk as far."""
    given = {"team.robots": 1, "planner.kind": "none", "world.seed": 53}
    config = load(None, given | {"sensors.yaw_drift": 0.05})
    references = references_of(config)
    rollout = Rollout(config, None, lambda tick: references(tick) if tick < 1000 else None)
    settled, imu = 0.0, 0.0
    for tick in rollout.ticks(16000):
        if tick.tick in (9000, 15999):
            w, x, y, z = rollout.world.states()["r1"].imu_quat_wxyz
            shown = float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
            settled, imu = true_yaw(rollout) - settled, shown - imu
    assert abs(imu) > np.radians(15.0), "the IMU has drifted meanwhile"
    assert abs(settled) < np.radians(1.5)
    assert rollout.world.fallen() == ()


def test_a_team_that_stands_long_enough_at_first_keeps_its_headings() -> None:
    given = {"team.robots": 2, "planner.kind": "none", "world.seed": 54, "gait.stand_ms": 9000}
    config = load(None, given | {"sensors.yaw_drift": 0.01})
    rollout = Rollout(config, None, references_of(config))
    for _ in rollout.ticks(21000):
        pass
    quats = np.asarray(rollout.world.truth().base_quat_wxyz).reshape(-1, 4)
    yaw = 2.0 * np.arctan2(quats[:, 3], quats[:, 0])
    shown = [rollout.world.states()[name].imu_quat_wxyz for name in ("r1", "r2")]
    drifted = [2.0 * np.arctan2(q[3], q[0]) for q in shown] - yaw
    assert np.abs(drifted).max() > np.radians(2.0)
    assert np.abs(yaw).max() < np.radians(1.0)  # 3 degrees after a short stand
