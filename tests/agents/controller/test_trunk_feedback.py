"""The trunk's desired acceleration: Newton and Euler, signs, symmetry, limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.controller import Task
from quadriga.agents.controller.estimator import Estimate
from quadriga.agents.controller.trunk_feedback import (
    Integrators,
    fall_freely,
    feedforward,
    trunk_gains,
)
from quadriga.shared.config.sections import Config, ControllerConfig
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import STAND_HEIGHT
from tests.agents.controller.parts import initial_integrators, rigid, trunk_acceleration, trunk_at
from tests.agents.controller.poses import BODY, random_pose, standing_pose

CONFIG = ControllerConfig(kp_xy=100.0)
GAINS = trunk_gains(Config(controller=CONFIG))
ALL = np.ones(4)
NOTHING = Task(0.0, 0.0, 0.0, STAND_HEIGHT, np.zeros(12), feedforward=False)
REST = initial_integrators(0.0)


def trunk(
    estimate: Estimate, task: Task = NOTHING, before: Integrators = REST, ground_height: float = 0.0
) -> Array:
    return trunk_acceleration(before, GAINS, BODY, estimate, task, ground_height, ALL, 1e-3)[1]


def rigid_body(deviation: Array, stance: Array, estimate: Estimate) -> Array:
    return feedforward(deviation, stance, trunk_at(estimate), estimate.p_foot, rigid(BODY))


def turned(estimate: Estimate, yaw: float) -> Estimate:
    """The same situation seen from an odometry frame turned by −yaw."""
    Z = pin.utils.rotate("z", yaw)
    return estimate._replace(
        position=Z @ estimate.position,
        velocity=Z @ estimate.velocity,
        R=Z @ estimate.R,
        p_foot=estimate.p_foot @ Z.T,
    )


@given(st.integers(0, 2**31))
@settings(deadline=None, max_examples=40)
def test_force_deviations_accelerate_a_rigid_body_as_newton_and_euler_say(seed: int) -> None:
    """F = m a and τ = I α + ω × I ω at ω = 0, about the centre of mass, forces in the yaw frame."""
    random = np.random.default_rng(seed)
    estimate = random_pose(random).estimate
    stance, deviation = random.integers(0, 2, 4).astype(float), random.normal(size=12) * 20.0
    yaw = np.arctan2(estimate.R[1, 0], estimate.R[0, 0])
    forces = deviation.reshape(4, 3) @ pin.utils.rotate("z", yaw).T * stance[:, None]
    com = estimate.position + estimate.R @ BODY.com
    inertia = estimate.R @ np.linalg.inv(BODY.inertia_inverse) @ estimate.R.T
    a = rigid_body(deviation, stance, estimate)
    np.testing.assert_allclose(BODY.mass * a[:3], forces.sum(axis=0), atol=1e-10)
    np.testing.assert_allclose(
        inertia @ a[3:], np.cross(estimate.p_foot - com, forces).sum(axis=0), atol=1e-10
    )


def test_lifting_the_left_side_rolls_the_robot_to_the_right() -> None:
    lift = np.zeros((4, 3))
    lift[[0, 2], 2] = 10.0
    a = rigid_body(lift.ravel(), ALL, standing_pose().estimate)
    assert a[2] == pytest.approx(20.0 / BODY.mass)
    assert a[3] > 0.0
    assert abs(a[5]) < 0.05 * a[3]


@given(st.integers(0, 2**31))
@settings(deadline=None, max_examples=20)
def test_no_deviation_is_exactly_the_low_level_alone(seed: int) -> None:
    estimate = random_pose(np.random.default_rng(seed)).estimate
    plain, fed = (trunk(estimate, replace(NOTHING, feedforward=on)) for on in (False, True))
    assert plain.tobytes() == fed.tobytes()
    assert not rigid_body(np.zeros(12), ALL, estimate).any()


def test_deviations_count_only_when_they_are_to_be_fed_forward() -> None:
    estimate, deviation = standing_pose().estimate, np.tile([0.0, 0.0, 5.0], 4)
    task = replace(NOTHING, deviation=deviation)
    np.testing.assert_array_equal(trunk(estimate, task), trunk(estimate))
    fed = trunk(estimate, replace(task, feedforward=True)) - trunk(estimate)
    assert fed[2] == pytest.approx(20.0 / BODY.mass)


def test_a_robot_that_does_what_it_is_told_is_left_alone() -> None:
    np.testing.assert_allclose(trunk(standing_pose().estimate), 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "component", "expected"),
    [
        ({"position": np.array([0.0, 0.0, STAND_HEIGHT - 0.01])}, 2, 0.01 * CONFIG.kp_z),
        ({"velocity": np.array([0.0, 0.0, 0.1])}, 2, -0.1 * CONFIG.kd_z),
        ({"velocity": np.array([0.1, 0.0, 0.0])}, 0, -0.1 * CONFIG.kd_xy),
        ({"velocity": np.array([0.0, -0.1, 0.0])}, 1, 0.1 * CONFIG.kd_xy),
        ({"R": pin.utils.rotate("x", 0.02)}, 3, -0.02 * CONFIG.kp_tilt),
        ({"R": pin.utils.rotate("y", 0.02)}, 4, -0.02 * CONFIG.kp_tilt),
        ({"R": pin.utils.rotate("z", 0.02)}, 5, -0.02 * CONFIG.kp_yaw),
        ({"omega": np.array([0.1, 0.0, 0.0])}, 3, -0.1 * CONFIG.kd_tilt),
        ({"omega": np.array([0.0, 0.1, 0.0])}, 4, -0.1 * CONFIG.kd_tilt),
        ({"omega": np.array([0.0, 0.0, 0.1])}, 5, -0.1 * CONFIG.kd_yaw),
    ],
)
def test_feedback_opposes_every_error(
    change: dict[str, Any], component: int, expected: float
) -> None:
    found = trunk(standing_pose().estimate._replace(**change))
    assert found[component] == pytest.approx(expected, rel=0.01)
    np.testing.assert_allclose(np.delete(found, component), 0.0, atol=1e-6)


def test_the_operator_is_followed() -> None:
    task = Task(0.2, -0.1, 0.3, STAND_HEIGHT + 0.01, np.zeros(12), feedforward=False)
    found = trunk(standing_pose().estimate, task, ground_height=0.02)
    expected = [0.2 * CONFIG.kd_xy, -0.1 * CONFIG.kd_xy, 0.03 * CONFIG.kp_z, 0.0, 0.0]
    np.testing.assert_allclose(found[:5], expected, rtol=0.02, atol=1e-9)
    assert found[5] == pytest.approx(0.3 * CONFIG.kd_yaw, rel=0.02)


@given(st.integers(0, 2**31), st.floats(-3.0, 3.0))
@settings(deadline=None, max_examples=40)
def test_north_is_nowhere(seed: int, yaw: float) -> None:
    """Turn robot, heading and all: the accelerations turn with them."""
    random = np.random.default_rng(seed)
    estimate = random_pose(random).estimate
    heading = np.arctan2(estimate.R[1, 0], estimate.R[0, 0]) + random.uniform(-0.2, 0.2)
    before = Integrators(0.01, random.normal(size=2) * 0.05, random.normal(size=2) * 0.02, heading)
    task = Task(random.normal(), random.normal(), 0.2, 0.25, random.normal(size=12) * 10.0, True)
    here = trunk(estimate, task, before)
    there = trunk(turned(estimate, yaw), task, before._replace(yaw=heading + yaw))
    Z = pin.utils.rotate("z", yaw)
    np.testing.assert_allclose(there[:3], Z @ here[:3], atol=1e-8)
    np.testing.assert_allclose(there[3:], Z @ here[3:], atol=1e-8)


def test_integrators_take_standing_errors_out_but_never_wind_up() -> None:
    """Held 5 cm low and back for 10 s: every integral stops at its limit and is soon undone."""
    stuck = standing_pose().estimate._replace(position=np.array([0.0, 0.0, STAND_HEIGHT - 0.05]))
    task = replace(NOTHING, vx=0.5, vy=-0.5)
    state, pushes = REST, []
    for _ in range(10_000):
        state, push, _ = trunk_acceleration(state, GAINS, BODY, stuck, task, 0.0, ALL, 1e-3)
        pushes.append(push)
    assert pushes[-1][2] > pushes[0][2] + 1.0
    assert pushes[-1][0] > pushes[0][0] + 1.0
    np.testing.assert_array_equal(pushes[-1], pushes[-2])
    np.testing.assert_allclose(np.abs(state.position_error), CONFIG.position_error_limit)
    assert abs(state.height) <= 0.05
    assert np.abs(state.speed).max() <= 0.15
    back = stuck._replace(position=np.array([0.0, 0.0, STAND_HEIGHT + 0.05]))
    released, _, _ = trunk_acceleration(state, GAINS, BODY, back, task, 0.0, ALL, 1e-3)
    assert released.height < state.height


def test_the_heading_is_integrated_around_the_circle() -> None:
    state, task = initial_integrators(3.0), replace(NOTHING, wz=1.0)
    estimate = standing_pose(3.0).estimate
    for _ in range(200):
        state, push, _ = trunk_acceleration(state, GAINS, BODY, estimate, task, 0.0, ALL, 1e-3)
    assert state.yaw == pytest.approx(3.2 - 2 * np.pi)
    assert push[5] == pytest.approx(0.2 * CONFIG.kp_yaw + CONFIG.kd_yaw)


@pytest.mark.parametrize("wz", [-1.0, 1.0])
def test_a_robot_that_cannot_turn_is_never_asked_to_turn_back(wz: float) -> None:
    """Else its heading would be half a circle away after 3 s, and the shorter way the wrong one."""
    state, task = initial_integrators(3.0), replace(NOTHING, wz=wz)
    estimate = standing_pose(3.0).estimate
    for _ in range(10_000):
        state, push, _ = trunk_acceleration(state, GAINS, BODY, estimate, task, 0.0, ALL, 1e-3)
        assert push[5] * wz > 0.0
    assert push[5] == pytest.approx(wz * (0.3 * CONFIG.kp_yaw + CONFIG.kd_yaw))
    assert (state.yaw - 3.0) % (wz * 2 * np.pi) == pytest.approx(wz * 0.3, abs=2e-3)


def test_the_speed_integral_forgets() -> None:
    """A standing error e leaves e · leak · (1 − exp(−t/leak)), so biases cannot wind it up."""
    task = replace(NOTHING, vx=0.004)
    estimate, state = standing_pose().estimate, REST
    for tick in range(1, 20_001):
        state, _, _ = trunk_acceleration(state, GAINS, BODY, estimate, task, 0.0, ALL, 1e-3)
        if tick in (1000, 5000, 20_000):
            expected = 0.004 * CONFIG.leak_xy * -np.expm1(-1e-3 * tick / CONFIG.leak_xy)
            assert state.speed[0] == pytest.approx(expected, rel=1e-3)


def test_only_a_robot_in_the_air_is_asked_to_fall_freely() -> None:
    trunk = np.arange(1.0, 7.0)
    fall_freely(trunk, np.array([0.0, 1.0, 0.0, 0.0]))
    np.testing.assert_array_equal(trunk, np.arange(1.0, 7.0))
    fall_freely(trunk, np.zeros(4))
    np.testing.assert_array_equal(trunk, [0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
