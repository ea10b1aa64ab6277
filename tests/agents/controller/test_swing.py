"""Swing trajectories and footholds."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.controller.swing import (
    MotionReference,
    foothold,
    limit_foothold,
    limit_inwards,
    swing_reference,
)
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import Array
from tests.a1 import FOOT_RADIUS

START, TARGET = np.array([0.1, -0.2, 0.03]), np.array([0.25, -0.15])
GROUND, APEX, DURATION = 0.01, 0.12, 0.2


def reference(progress: float, delay: float = 0.0) -> Array:
    return swing_reference(START, TARGET, GROUND + FOOT_RADIUS, APEX, progress, DURATION, delay)


def test_a_swing_starts_where_the_foot_is_and_at_rest() -> None:
    position, velocity, _ = reference(0.0)
    np.testing.assert_allclose(position, START, atol=1e-15)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-15)


def test_a_swing_ends_in_the_foothold_and_at_rest() -> None:
    """A little below the expected ground, so that the foot surely touches it."""
    position, velocity, _ = reference(1.0)
    np.testing.assert_allclose(position[:2], TARGET, atol=1e-15)
    assert GROUND + FOOT_RADIUS - 0.01 < position[2] < GROUND + FOOT_RADIUS
    np.testing.assert_allclose(velocity, 0.0, atol=1e-12)


def test_the_foot_comes_down_vertically() -> None:
    for progress in (0.9, 0.95, 0.99):
        position, velocity, _ = reference(progress)
        np.testing.assert_allclose(position[:2], TARGET, atol=1e-12)
        np.testing.assert_allclose(velocity[:2], 0.0, atol=1e-12)


def test_at_half_time_the_foot_is_at_its_apex() -> None:
    assert reference(0.5)[0, 2] == pytest.approx(APEX, abs=1e-15)
    heights = [reference(progress)[0, 2] for progress in np.linspace(0.0, 1.0, 101)]
    assert max(heights) == pytest.approx(APEX, abs=2e-3)


@given(
    arrays(np.float64, 3, elements=st.floats(-0.3, 0.3)),
    arrays(np.float64, 2, elements=st.floats(-0.3, 0.3)),
    st.floats(-0.1, 0.1),
    st.floats(0.05, 0.2),
    st.floats(0.01, 0.99),
    st.floats(0.1, 0.5),
    st.floats(0.0, 0.3),
)
@settings(deadline=None, max_examples=50)
def test_velocity_and_acceleration_are_the_derivatives(
    start: Array,
    target: Array,
    ground: float,
    apex: float,
    progress: float,
    duration: float,
    delay: float,
) -> None:
    if min(abs(progress - 0.9), abs(progress - delay)) < 1e-3:
        progress = 0.5  # the plane's jerk jumps where it begins and where it is done
    h = 1e-4
    before, now, after = (
        swing_reference(start, target, ground, apex, progress + step, duration, delay)
        for step in (-h, 0.0, h)
    )
    dt = h * duration
    np.testing.assert_allclose(
        now[1], (after[0] - before[0]) / (2 * dt), atol=1e-5 + 1e-6 / duration
    )
    np.testing.assert_allclose(now[2], (after[1] - before[1]) / (2 * dt), atol=1e-3, rtol=1e-4)


def test_a_delayed_swing_rises_before_it_goes_forward() -> None:
    position, velocity, _ = reference(0.2, delay=0.2)
    np.testing.assert_array_equal(position[:2], START[:2])
    np.testing.assert_array_equal(velocity[:2], 0.0)
    np.testing.assert_allclose(reference(0.9, delay=0.2)[0, :2], TARGET, atol=1e-15)
    assert position[2] == reference(0.2)[0, 2] > START[2] + 0.02


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
    shortened = np.linalg.norm(found) < np.linalg.norm(way) - 1e-9
    if shortened:
        assert most == pytest.approx(acceleration, rel=1e-4)
    np.testing.assert_allclose(found * np.linalg.norm(way), way * np.linalg.norm(found), atol=1e-9)


@given(
    st.integers(0, 3),
    st.floats(-3.0, 3.0),
    st.floats(-0.5, 0.5),
    st.floats(-0.5, 0.5),
    st.floats(0.0, 0.5),
)
@settings(deadline=None, max_examples=100)
def test_a_foothold_lies_no_farther_inwards_than_the_limit(
    leg: int, yaw: float, forwards: float, outwards: float, limit: float
) -> None:
    """Seen from under the hip in the yaw frame, only the part inwards beyond the limit goes."""
    turn, (x, y) = pin.utils.rotate("z", yaw)[:2, :2], A1.feet_under_hips[leg]
    position, side = np.array([0.3, -0.2, 0.28]), np.sign(y)
    target = position[:2] + turn @ np.array([x + forwards, y + side * outwards])
    R = pin.rpy.rpyToMatrix(0.2, -0.1, yaw)
    limit_inwards(target, float(y), position, R, limit)
    found = turn.T @ (target - position[:2]) - np.array([x, y])
    np.testing.assert_allclose(found, [forwards, side * max(outwards, -limit)], atol=1e-12)


@given(st.integers(0, 3), st.integers(0, 2**31))
@settings(deadline=None, max_examples=50)
def test_the_foothold_is_raiberts(leg: int, seed: int) -> None:
    """p_hip + v t_remaining + v T/2 + k (v − v_des), v the hip's: the yaw rate moves it too."""
    random = np.random.default_rng(seed)
    roll, pitch, yaw = random.uniform([-0.4, -0.4, -3.0], [0.4, 0.4, 3.0])
    R, (x, y) = pin.rpy.rpyToMatrix(roll, pitch, yaw), A1.feet_under_hips[leg]
    under_hip = float(x), float(y)
    position, velocity, v_des = random.uniform(-1.0, 1.0, (3, 3))
    wz, remaining, stance_time, gain = random.uniform(0.0, [0.5, 0.2, 0.3, 0.1])
    arm = pin.utils.rotate("z", yaw) @ np.array([*under_hip, 0.0])
    hip_velocity = velocity + np.cross([0.0, 0.0, wz], arm)
    expected = position + arm + hip_velocity * (remaining + stance_time / 2)
    expected += gain * (velocity - v_des)
    motion = MotionReference(velocity, v_des, wz, 0.1)
    found = foothold(under_hip, position, R, motion, remaining, stance_time, gain)
    np.testing.assert_allclose(found, expected[:2], atol=1e-12)
