"""The trunk's desired acceleration: Newton and Euler, signs, symmetry, limits; its heading."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.trunk import (
    COMMAND,
    FOLLOW_S,
    LEAK,
    POSITION_LIMIT,
    SETTLED_S,
    accumulate_forces,
    feedforward,
    keep_heading,
    trunk_reference,
)
from quadriga.agents.estimator.kinematics import wrap_angle
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array
from quadriga.team.operator import references_of
from tests.a1 import STAND_HEIGHT, nominal_forces
from tests.agents.estimator.poses import DT, gains_of, random_pose, standing_pose

GAINS = gains_of(kp_xy=100.0)
ALL = np.ones(4)


def command_of(**fields: Any) -> Any:
    """The record of a command to stand still but for these fields."""
    asked = np.zeros(COMMAND.itemsize // 8).view(COMMAND)[0]
    asked.height = STAND_HEIGHT
    for name, value in fields.items():
        setattr(asked, name, value)
    return asked


def trunk(state: Any, **fields: Any) -> Array:
    """The desired acceleration; the state goes on."""
    asked = command_of(**fields)
    deviation = accumulate_forces(state, asked, GAINS.weight)
    acc: Array = trunk_reference(state, asked, GAINS, deviation)
    return acc


@given(st.integers(0, 2**31))
@settings(deadline=None, max_examples=40)
def test_force_deviations_accelerate_a_rigid_body_as_newton_and_euler_say(seed: int) -> None:
    """F = m a and τ = I α + ω × I ω at ω = 0, about the centre of mass, forces in the yaw frame."""
    random = np.random.default_rng(seed)
    pose, deviation = random_pose(random), random.normal(size=12) * 20.0
    pose.stance = random.integers(0, 2, 4)
    yaw = np.arctan2(pose.R[1, 0], pose.R[0, 0])
    forces = deviation.reshape(4, 3) @ pin.utils.rotate("z", yaw).T * pose.stance[:, None]
    com = pose.position + pose.R @ GAINS.com
    inertia = pose.R @ np.linalg.inv(GAINS.inertia_inverse) @ pose.R.T
    a = feedforward(pose, GAINS, deviation)
    np.testing.assert_allclose(GAINS.body_mass * a[:3], forces.sum(axis=0), atol=1e-10)
    torque = np.cross(pose.p_foot - com, forces).sum(axis=0)
    np.testing.assert_allclose(inertia @ a[3:], torque, atol=1e-10)
    assert not feedforward(pose, GAINS, np.zeros(12)).any()


def test_deviations_accelerate_only_when_they_are_to_be_fed_forward() -> None:
    up, plain = np.tile([0.0, 0.0, 5.0], 4), trunk(standing_pose())
    np.testing.assert_allclose(plain, 0.0, atol=1e-9)
    np.testing.assert_array_equal(trunk(standing_pose(), deviation=up), plain)
    fed = trunk(standing_pose(), deviation=up, feedforward=1.0) - plain
    assert fed[2] == pytest.approx(20.0 / GAINS.body_mass)


@pytest.mark.parametrize(
    ("change", "component", "expected"),
    [
        ({"position": [0.0, 0.0, STAND_HEIGHT - 0.01]}, 2, 0.01 * GAINS.kp_z),
        ({"velocity": [0.0, 0.0, 0.1]}, 2, -0.1 * GAINS.kd_z),
        ({"velocity": [0.1, 0.0, 0.0]}, 0, -0.1 * GAINS.kd_xy),
        ({"velocity": [0.0, -0.1, 0.0]}, 1, 0.1 * GAINS.kd_xy),
        ({"R": pin.utils.rotate("x", 0.02)}, 3, -0.02 * GAINS.kp_tilt),
        ({"R": pin.utils.rotate("y", 0.02)}, 4, -0.02 * GAINS.kp_tilt),
        ({"R": pin.utils.rotate("z", 0.02)}, 5, -0.02 * GAINS.kp_yaw),
        ({"omega": [0.1, 0.0, 0.0]}, 3, -0.1 * GAINS.kd_tilt),
        ({"omega": [0.0, 0.1, 0.0]}, 4, -0.1 * GAINS.kd_tilt),
        ({"omega": [0.0, 0.0, 0.1]}, 5, -0.1 * GAINS.kd_yaw),
    ],
)
def test_feedback_opposes_every_error(
    change: dict[str, Any], component: int, expected: float
) -> None:
    pose = standing_pose()
    for name, value in change.items():
        setattr(pose, name, value)
    found = trunk(pose)
    assert found[component] == pytest.approx(expected, rel=0.01)
    np.testing.assert_allclose(np.delete(found, component), 0.0, atol=1e-6)


def test_the_command_is_followed() -> None:
    pose = standing_pose()
    pose.ground_height = 0.02
    found = trunk(pose, vx=0.2, vy=-0.1, wz=0.3, height=STAND_HEIGHT + 0.01, roll=0.01, pitch=-0.02)
    tilt = 0.01 * GAINS.kp_tilt * np.array([1.0, -2.0])
    expected = [0.2 * GAINS.kd_xy, -0.1 * GAINS.kd_xy, 0.03 * GAINS.kp_z, *tilt]
    np.testing.assert_allclose(found[:5], expected, rtol=0.02, atol=1e-9)
    assert found[5] == pytest.approx(0.3 * GAINS.kd_yaw, rel=0.02)


@given(st.integers(0, 2**31), st.floats(-3.0, 3.0))
@settings(deadline=None, max_examples=40)
def test_north_is_nowhere(seed: int, yaw: float) -> None:
    """Turn robot, heading and all: the accelerations turn with them."""
    random, Z = np.random.default_rng(seed), pin.utils.rotate("z", yaw)
    here = random_pose(random)
    here.yaw_des = np.arctan2(here.R[1, 0], here.R[0, 0]) + random.uniform(-0.2, 0.2)
    here.height_integral, here.speed_integral = 0.01, random.normal(size=2) * 0.05
    there, (vx, vy) = here.copy(), random.normal(size=2)
    fields: dict[str, Any] = {"vx": vx, "vy": vy, "wz": 0.2, "feedforward": 1.0}
    there.position, there.velocity = Z @ here.position, Z @ here.velocity
    there.R, there.p_foot, there.yaw_des = Z @ here.R, here.p_foot @ Z.T, here.yaw_des + yaw
    fields["deviation"] = random.normal(size=12) * 10.0
    found, turned = trunk(here, **fields), trunk(there, **fields)
    np.testing.assert_allclose(turned[:3], Z @ found[:3], atol=1e-8)
    np.testing.assert_allclose(turned[3:], Z @ found[3:], atol=1e-8)


def test_integrators_take_standing_errors_out_but_never_wind_up() -> None:
    """Held 5 cm low and back for 10 s: every integral stops at its limit and is soon undone."""
    pose = standing_pose()
    pose.position[2] = STAND_HEIGHT - 0.05
    accs = [trunk(pose, vx=0.5, vy=-0.5) for _ in range(10_000)]
    assert accs[-1][2] > accs[0][2] + 1.0
    assert accs[-1][0] > accs[0][0] + 1.0
    np.testing.assert_array_equal(accs[-1], accs[-2])
    np.testing.assert_allclose(np.abs(pose.position_error), POSITION_LIMIT)
    assert abs(pose.height_integral) <= 0.05
    assert np.abs(pose.speed_integral).max() <= 0.15
    pose.position[2], before = STAND_HEIGHT + 0.05, float(pose.height_integral)
    trunk(pose)
    assert pose.height_integral < before


def test_the_speed_integral_forgets() -> None:
    """A standing error e leaves e · leak · (1 − exp(−t/leak)), so biases cannot wind it up."""
    pose = standing_pose()
    for tick in range(1, 10_001):
        trunk(pose, vx=0.004)
        if tick in (1000, 10_000):
            expected = 0.004 * LEAK * -np.expm1(-1e-3 * tick / LEAK)
            assert pose.speed_integral[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("wz", [-1.0, 1.0])
def test_the_heading_goes_round_the_circle_but_not_behind_one_that_cannot_turn(wz: float) -> None:
    """Else its heading would be half a circle away after 3 s, and the shorter way the wrong one."""
    pose = standing_pose(3.0)
    pose.half_cycle = 0.0
    accs = [trunk(pose, wz=wz)[5] for _ in range(200)]
    assert pose.yaw_des == pytest.approx(wrap_angle(3.0 + 0.2 * wz))
    assert accs[-1] == pytest.approx(wz * (0.2 * GAINS.kp_yaw + GAINS.kd_yaw))
    accs += [trunk(pose, wz=wz)[5] for _ in range(4800)]
    assert min(acc * wz for acc in accs) > 0.0
    assert accs[-1] == pytest.approx(wz * (0.3 * GAINS.kp_yaw + GAINS.kd_yaw))
    assert (pose.yaw_des - 3.0) % (wz * 2 * np.pi) == pytest.approx(wz * 0.3, abs=2e-3)


def test_a_sample_of_forces_is_their_mean_over_its_ticks() -> None:
    """Nominal weight on the scheduled feet plus the deviation, from the tick it begins with."""
    trot, random, applied = np.array([1.0, 0.0, 0.0, 1.0]), np.random.default_rng(1), []
    pose = standing_pose()
    pose.stance = trot
    for tick in range(25):
        asked = command_of(deviation=random.normal(size=12), new_sample=float(tick == 15))
        deviation = accumulate_forces(pose, asked, GAINS.weight)
        np.testing.assert_array_equal(deviation, asked.deviation * np.repeat(trot, 3))
        applied.append(nominal_forces(trot > 0.5) + deviation)
        expected = np.mean(applied[15 if tick >= 15 else 0 :], axis=0)
        np.testing.assert_allclose(pose.force_sum / pose.force_count, expected, atol=1e-12)


def stand(state: Any, seconds: float, rate: float) -> float:
    """Stand while the odometry frame turns; how far it has turned in the end, rad."""
    feet, angle = standing_pose().p_foot.copy(), 0.0
    for tick in range(1, round(seconds / DT) + 1):
        angle = rate * tick * DT
        state.p_foot = feet @ pin.utils.rotate("z", angle).T
        keep_heading(state)
    return angle


@pytest.mark.parametrize("rate", [-0.05, 0.002, 0.3])
def test_after_a_short_stand_the_heading_turns_with_the_feet_a_time_constant_behind(
    rate: float,
) -> None:
    state = standing_pose(0.3)
    stand(state, SETTLED_S - 0.01, rate)
    state.contact[2] = 0.0  # a foot in the air begins the stand anew
    keep_heading(state)
    state.contact[2] = 1.0
    stand(state, SETTLED_S - 0.01, rate)
    assert state.yaw_des == 0.3
    state = standing_pose(0.3)
    stand(state, SETTLED_S, rate)
    angle = stand(state, 20.0, rate) - rate * SETTLED_S  # the first stand turns the frame back
    expected = wrap_angle(0.3 + angle - rate * FOLLOW_S)
    assert wrap_angle(state.yaw_des - expected) == pytest.approx(0.0, abs=2e-3 * abs(rate))


def test_a_robot_stands_on_although_its_imu_turns() -> None:
    """It walked, and its operator left. A heading by the IMU would turn the trunk as far."""
    given = {"team.robots": 1, "planner.kind": "none", "world.seed": 53}
    config = load(None, given | {"sensors.yaw_drift": 0.05})
    references = references_of(config)
    rollout = Rollout(config, None, lambda tick: references(tick) if tick < 1000 else None)
    settled = imu = 0.0

    def yaw(quat: Any) -> float:
        w, x, y, z = np.asarray(quat).ravel()
        return float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))

    for tick in rollout.ticks(16000):
        if tick.tick in (9000, 15999):
            settled = yaw(rollout.world.truth().base_quat_wxyz) - settled
            imu = yaw(rollout.world.states()["r1"].imu_quat_wxyz) - imu
    assert abs(imu) > np.radians(15.0), "the IMU has drifted meanwhile"
    assert abs(settled) < np.radians(1.5)
    assert rollout.world.fallen() == ()
