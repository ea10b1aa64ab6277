"""What the leg of a lost joint bears while a robot stands without knowing it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.held_posture import HeldPosture
from quadriga.agents.modes import STAND, Mode
from quadriga.agents.sensor_loss import SensorLoss
from quadriga.shared.robot.a1 import A1
from quadriga.shared.robot.conventions import GRAVITY, JOINT_NAMES, Array
from quadriga.shared.wire.messages import Command
from tests.a1 import standing

POSTURE = HeldPosture(A1)
CORNERS = {"FL": (1, 1), "FR": (1, -1), "RL": (-1, 1), "RR": (-1, -1)}


def torques(leg: str, roll: float, pitch: float, rates: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Torque of the lost knee of a leg, N·m, where the trunk has this small roll and pitch, rad."""
    joint = JOINT_NAMES.index(f"{leg}_calf_joint")
    quat = np.array([1.0, 0.5 * roll, 0.5 * pitch, 0.0])
    gyro = np.array([*rates, 0.0])
    state = replace(standing(10), imu_quat_wxyz=quat / np.linalg.norm(quat), imu_gyro=gyro)
    loss = SensorLoss("encoder-lost", (joint,), now=True)
    _, row = POSTURE.step(None, Mode(STAND, 0, "encoder-lost"), state, loss)
    assert row is not None
    assert row[Command.CUTS["kp"]][joint] == row[Command.CUTS["kd"]][joint] == 0.0
    return np.asarray(row[Command.CUTS["tau"]][joint])


@pytest.mark.parametrize("leg", CORNERS)
def test_a_level_trunk_has_a_quarter_of_its_weight_on_the_leg(leg: str) -> None:
    _, thigh, calf = A1.q_stand[:3]
    lever = A1.geometry.link * abs(np.sin(thigh + calf))  # of a vertical force at the foot
    bears = GRAVITY * A1.geometry.mass / 4.0
    assert abs(torques(leg, 0.0, 0.0)) == pytest.approx(lever * bears, rel=0.03)


@pytest.mark.parametrize("leg", CORNERS)
def test_a_corner_that_is_lower_or_sinks_gets_more_and_one_that_is_higher_less(leg: str) -> None:
    (front, left), level = CORNERS[leg], torques(leg, 0.0, 0.0)
    x, y = np.abs(A1.feet_under_hips[0])
    down = 0.02  # m, half of what doubles it
    for lowered in (torques(leg, -left * down / y, 0.0), torques(leg, 0.0, front * down / x)):
        assert lowered / level == pytest.approx(1.5, abs=0.02)
    for raised in (torques(leg, left * down / y, 0.0), torques(leg, 0.0, -front * down / x)):
        assert raised / level == pytest.approx(0.5, abs=0.02)
    sinking = torques(leg, 0.0, 0.0, rates=(-left * 0.15 / y, 0.0))
    assert sinking / level == pytest.approx(1.5, abs=0.01)


def test_a_leg_bears_no_more_than_twice_its_share_and_never_pulls() -> None:
    level = torques("FL", 0.0, 0.0)
    assert torques("FL", -0.8, 0.0) == pytest.approx(2.0 * level)
    assert torques("FL", 0.8, 0.0) == 0.0
