"""Swing trajectories, footholds, and feet that find no ground or are stopped."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.controller.swing import (
    foothold,
    limit_foothold,
    swing_accelerations,
    swing_reference,
)
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import Array
from tests.a1 import FOOT_RADIUS
from tests.agents.estimator.poses import GAINS, gains_of, random_pose, standing_pose

START, TARGET = np.array([0.1, -0.2, 0.03]), np.array([0.25, -0.15])
GROUND, APEX, DURATION = 0.01, 0.12, 0.2
TROT = np.array([1.0, 0.0, 0.0, 1.0])


def reference(progress: float, delay: float = 0.0) -> Array:
    return swing_reference(START, TARGET, GROUND + FOOT_RADIUS, APEX, progress, DURATION, delay)


def test_a_swing_goes_from_where_the_foot_is_over_its_apex_down_into_the_foothold() -> None:
    """At rest at both ends; a little below the expected ground, so that the foot touches it."""
    for progress, place in ((0.0, START), (1.0, [*TARGET, GROUND + FOOT_RADIUS - 0.005])):
        position, velocity, _ = reference(progress)
        np.testing.assert_allclose(position, place, atol=1e-15)
        np.testing.assert_allclose(velocity, 0.0, atol=1e-12)
    assert reference(0.5)[0, 2] == pytest.approx(APEX, abs=1e-15)
    heights = [reference(progress)[0, 2] for progress in np.linspace(0.0, 1.0, 101)]
    assert max(heights) == pytest.approx(APEX, abs=2e-3)
    position, velocity, _ = reference(0.9)
    np.testing.assert_allclose(position[:2], TARGET, atol=1e-12)
    np.testing.assert_allclose(velocity[:2], 0.0, atol=1e-12)
    position, velocity, _ = reference(0.2, delay=0.2)  # it rises before it goes forward
    np.testing.assert_array_equal(position[:2], START[:2])
    np.testing.assert_array_equal(velocity[:2], 0.0)
    np.testing.assert_allclose(reference(0.9, delay=0.2)[0, :2], TARGET, atol=1e-15)
    assert position[2] == reference(0.2)[0, 2] > START[2] + 0.02


@given(
    arrays(np.float64, 3, elements=st.floats(-0.3, 0.3)),
    arrays(np.float64, 2, elements=st.floats(-0.3, 0.3)),
    st.floats(0.05, 0.2),
    st.floats(0.01, 0.99),
    st.floats(0.1, 0.5),
    st.floats(0.0, 0.3),
)
@settings(deadline=None, max_examples=50)
def test_velocity_and_acceleration_are_the_derivatives(
    start: Array, target: Array, apex: float, progress: float, duration: float, delay: float
) -> None:
    if min(abs(progress - 0.9), abs(progress - delay)) < 1e-3:
        progress = 0.5  # the plane's jerk jumps where it begins and where it is done
    h = 1e-4
    before, now, after = (
        swing_reference(start, target, GROUND, apex, progress + step, duration, delay)
        for step in (-h, 0.0, h)
    )
    dt = h * duration
    velocity, acceleration = (after[0] - before[0]) / (2 * dt), (after[1] - before[1]) / (2 * dt)
    np.testing.assert_allclose(now[1], velocity, atol=1e-5 + 1e-6 / duration)
    np.testing.assert_allclose(now[2], acceleration, atol=1e-3, rtol=1e-4)


@given(
    arrays(np.float64, 2, elements=st.floats(-0.3, 0.3)),
    st.floats(1.0, 200.0),
    st.floats(0.02, 0.3),
    st.floats(0.0, 0.3),
)
@settings(deadline=None, max_examples=50)
def test_a_foothold_within_reach_asks_for_no_more_acceleration(
    way: Array, acceleration: float, duration: float, delay: float
) -> None:
    start, target = np.array([0.1, 0.2, 0.0]), np.array([0.1, 0.2]) + way
    limit_foothold(target, start, acceleration, duration, delay)
    found = target - start[:2]
    asked = [
        swing_reference(start, target, GROUND, APEX, progress, duration, delay)[2, :2]
        for progress in np.linspace(0.0, 1.0, 1001)
    ]
    most = np.linalg.norm(asked, axis=1).max()
    assert most <= acceleration * (1.0 + 1e-9)
    if np.linalg.norm(found) < np.linalg.norm(way) - 1e-9:
        assert most == pytest.approx(acceleration, rel=1e-4)
    np.testing.assert_allclose(found * np.linalg.norm(way), way * np.linalg.norm(found), atol=1e-9)


@given(st.integers(0, 3), st.integers(0, 2**31), st.floats(0.0, 0.3), st.floats(0.0, 9.0))
@settings(deadline=None, max_examples=80)
def test_the_foothold_is_raiberts_and_no_farther_inwards_than_the_limit(
    leg: int, seed: int, limit: float, payload: float
) -> None:
    """p_hip + v t_remaining + v T/2 + k (v − v_des), v the hip's: the yaw rate moves it too.

    Seen from under the hip in the yaw frame, only the part inwards beyond the limit goes.
    """
    random = np.random.default_rng(seed)
    pose, gains, wz = random_pose(random), gains_of(foothold_inwards=limit), random.uniform(0, 0.5)
    pose.progress, pose.v_des, pose.payload = random.uniform(), random.uniform(-1, 1, 2), payload
    turn = pin.utils.rotate("z", np.arctan2(pose.R[1, 0], pose.R[0, 0]))
    arm = turn @ np.array([*A1.feet_under_hips[leg], 0.0])
    v_hip = (pose.velocity + np.cross([0.0, 0.0, wz], arm))[:2]
    v_error = pose.velocity[:2] - pose.v_des
    expected = (pose.position + arm)[:2] + v_hip * (0.2 * (1.0 - pose.progress) + 0.1)
    expected += gains.raibert_gain * v_error
    side = np.sign(A1.feet_under_hips[leg][1])
    forwards, left = turn[:2, :2].T @ (expected - (pose.position + arm)[:2])
    left = side * max(side * left, -limit * (1.0 + payload / GAINS.body_mass))
    expected = (pose.position + arm)[:2] + turn[:2, :2] @ [forwards, left]
    np.testing.assert_allclose(foothold(pose, wz, gains, leg), expected, atol=1e-12)


def swinging(**controller: Any) -> tuple[Any, Any]:
    """A robot whose feet FR and RL swing, and its gains."""
    pose = standing_pose()
    pose.stance = pose.contact = TROT
    pose.half_cycle, pose.progress, pose.switched = 0.0, 0.0, 1.0
    gains = gains_of(**controller)
    swing_accelerations(pose, 0.0, gains)
    pose.switched = 0.0
    return pose, gains


def test_swing_feet_follow_their_reference() -> None:
    """ẍ = ẍ_ref + Kp (x_ref − x) + Kd (ẋ_ref − ẋ), start at the switch, goal at the foothold."""
    pose, gains = swinging()
    start, pose.progress = pose.p_foot[1].copy(), 0.4
    pose.ground, pose.velocity = [0.01, 0.05, 0.0, 0.02], [0.3, 0.1, 0.0]
    pose.p_foot[1] += [0.02, 0.01, 0.05]
    pose.v_foot[1] = [0.5, -0.1, 0.2]
    found = swing_accelerations(pose, 0.3, gains)
    target, ground = foothold(pose, 0.3, gains, 1), 0.015 + FOOT_RADIUS
    x, v, a = swing_reference(start, target, ground, 0.05 + gains.swing_height, 0.4, 0.2, 0.0)
    expected = a + gains.kp_swing * (x - pose.p_foot[1]) + gains.kd_swing * (v - pose.v_foot[1])
    np.testing.assert_allclose(found[1], expected, atol=1e-8)
    np.testing.assert_allclose(pose.reaction[1], a - expected, atol=1e-8)
    assert not found[[0, 3]].any()


def test_stance_feet_without_ground_follow_a_sinking_trunk_within_reach() -> None:
    pose, gains = swinging()
    pose.contact, pose.velocity[2] = 0.0, -1.0
    swing_accelerations(pose, 0.0, gains)
    before = pose.foot_goal.copy()
    found = swing_accelerations(pose, 0.0, gains)
    descent = before - pose.foot_goal
    np.testing.assert_allclose(descent[[0, 3], 2], 1e-3 * (gains.descent_speed + 1.0), atol=1e-12)
    sunk = pose.p_foot[0, 2] - pose.foot_goal[0, 2]
    expected = -gains.kp_swing * sunk - gains.kd_swing * gains.descent_speed
    np.testing.assert_allclose(found[0], [0.0, 0.0, expected], atol=1e-9)
    for _ in range(500):
        swing_accelerations(pose, 0.0, gains)
    np.testing.assert_allclose(pose.foot_goal[[0, 3], 2], pose.position[2] - gains.reach)
    pose.contact = TROT  # they have found the ground
    swing_accelerations(pose, 0.0, gains)
    np.testing.assert_array_equal(pose.foot_goal, pose.p_foot)


def test_a_foot_that_retracts_rises_and_moves_away_from_what_stopped_it() -> None:
    """Then its swing begins anew from where it is."""
    pose, gains = swinging()
    pose.progress, pose.retraction[1], pose.reaction[1] = 0.4, 0.005, [-60.0, 0.0, 10.0]
    away = gains.kd_swing  # times 1 m/s
    found = swing_accelerations(pose, 0.0, gains)[1]
    np.testing.assert_allclose(found, [-0.3 * away, 0.0, away], atol=1e-9)
    pose.retraction[1], pose.lift[1], pose.p_foot[1, 0] = 0.0, 0.4, 0.123
    swing_accelerations(pose, 0.0, gains)
    np.testing.assert_array_equal(pose.swing_start[1], pose.p_foot[1])
