"""The filter on data whose truth is known, synthesised through Pinocchio, and the IMU's error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.estimator.estimator import estimate, outputs_at, truth_row
from quadriga.agents.estimator.filter import (
    filter_step,
    foot_trust,
    known_covariance,
    take_imu_error_off,
    update_imu_error,
)
from quadriga.agents.estimator.robot_state import gains_row
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import State, Truth
from quadriga.shared.robots.conventions import GRAVITY, N_JOINTS, Array
from tests.a1 import FOOT_RADIUS, STAND_HEIGHT, q_stand, standing_state
from tests.agents.estimator.poses import (
    DT,
    FEET,
    GAINS,
    MODEL,
    blank,
    pose_of,
    random_pose,
    read,
    record_of,
)

ALL = np.ones(4)
UP = np.array([0.0, 0.0, GRAVITY])
TILT_SHARE = 0.3


def sensed(q: Array, v: Array, acceleration: Array | None = None) -> State:
    """What perfect sensors measure at Pinocchio's (q, v); `acceleration` of the trunk, world."""
    R = pin.Quaternion(q[3:7]).matrix()
    force = R.T @ (UP + (0.0 if acceleration is None else acceleration))
    quat, tau, feet = np.array([q[6], q[3], q[4], q[5]]), np.zeros(N_JOINTS), np.full(4, 30.0)
    return State(0, 0, q[7:].copy(), v[6:].copy(), tau, quat, v[3:6].copy(), force, feet)


def standing() -> tuple[Array, Array]:
    q = np.concatenate([[0.0, 0.0, STAND_HEIGHT, 0.0, 0.0, 0.0, 1.0], q_stand()])
    return q, np.zeros(18)


def begun(sensors: State) -> Any:
    """The state before the first tick."""
    state = record_of(standing_state(sensors))
    state.dt = DT
    return state


def step(state: Any, sensors: State, trust: Array = ALL, tilt_time: float = 0.0) -> None:
    """One step of the filter, with the IMU's error if that has a time constant."""
    read(state, sensors)
    take_imu_error_off(state)
    update_imu_error(state, filter_step(state, GAINS, trust), tilt_time)


@dataclass(frozen=True)
class Rolling:
    """A trunk that moves as told over four spheres that roll on flat ground without slipping."""

    velocity: Array  # m/s, world
    omega: Array  # rad/s, world

    def rates(self, q: Array) -> Array:
        """Pinocchio's v of this motion at q: the lowest point of every foot is at rest."""
        data = MODEL.createData()
        pin.computeJointJacobians(MODEL, data, q)
        pin.updateFramePlacements(MODEL, data)
        R = pin.Quaternion(q[3:7]).matrix()
        v = np.concatenate([R.T @ self.velocity, R.T @ self.omega, np.zeros(N_JOINTS)])
        down = pin.skew(np.array([0.0, 0.0, -FOOT_RADIUS]))
        for leg, foot in enumerate(FEET):
            J = pin.getFrameJacobian(MODEL, data, foot, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            at_contact = J[:3] - down @ J[3:]  # of the point that touches the ground
            own = slice(6 + 3 * leg, 9 + 3 * leg)
            v[own] = np.linalg.solve(at_contact[:, own], -at_contact[:, :6] @ v[:6])
        return v

    def walk(self, ticks: int) -> Iterator[tuple[Array, Array]]:
        """(q, v) at every tick, integrated at the midpoint."""
        q, _ = standing()
        for _ in range(ticks):
            v = self.rates(q)
            yield q, v
            q = pin.integrate(MODEL, q, DT * self.rates(pin.integrate(MODEL, q, 0.5 * DT * v)))


def test_standing_still_stays_still() -> None:
    state = begun(sensed(*standing()))
    for _ in range(1000):
        step(state, sensed(*standing()))
    np.testing.assert_allclose(state.velocity, 0.0, atol=1e-12)
    np.testing.assert_allclose(state.position, [0.0, 0.0, STAND_HEIGHT], atol=1e-12)
    np.testing.assert_allclose(state.p_foot[:, 2], FOOT_RADIUS, atol=1e-12)


def test_an_error_of_the_accelerometer_becomes_no_speed() -> None:
    """Of a robot that stands; the error is found, without that it is 92 mm/s for each m/s²."""
    sensors, speeds = sensed(*standing(), np.array([0.1, -0.1, 0.15])), []
    for tilt_time in (0.0, 5.0):
        state = begun(sensors)
        for _ in range(3000):
            step(state, sensors, tilt_time=tilt_time)
        speeds.append(np.abs(state.velocity))
    assert (speeds[0] > 0.005).all()
    assert (speeds[1] < 0.002).all()


@pytest.mark.parametrize(
    ("velocity", "omega"),
    [
        ([0.4, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([-0.2, 0.15, 0.02], [0.0, 0.0, 0.0]),
        ([0.3, 0.1, 0.0], [0.0, 0.0, 0.5]),
        ([0.2, 0.0, 0.0], [0.3, -0.3, 0.2]),
    ],
)
def test_a_steady_trunk_over_rolling_feet_is_tracked(
    velocity: list[float], omega: list[float]
) -> None:
    """From the true state it stays there (feet taken for points: 7 % low); from rest it gets there.

    A filter that starts at rest must forget the jump: 0.2 s leave less than a twentieth of it.
    """
    motion = Rolling(np.array(velocity), np.array(omega))
    known = pose_of(*next(motion.walk(1)))
    known.filter_mean = np.vstack([known.position, known.velocity, known.p_foot])
    known.covariance = known_covariance()
    start = begun(sensed(*next(motion.walk(1))))
    for q, v in motion.walk(200):
        step(known, sensed(q, v))
        np.testing.assert_allclose(known.velocity, velocity, atol=1e-3)
        step(start, sensed(q, v))
        expected = pose_of(q, v).p_foot - q[:3]
        np.testing.assert_allclose(start.p_foot - start.position, expected, atol=1e-12)
    np.testing.assert_allclose(known.position, q[:3], atol=1e-3)
    assert np.linalg.norm(start.velocity - velocity) < 0.05 * np.linalg.norm(velocity)


def test_a_foot_in_swing_is_not_trusted() -> None:
    """One leg swings while three stand: it pulls the velocity along only if it is an anchor."""
    worst = []
    for trust in (0.0, 1.0):
        q, v = standing()
        state, speeds = begun(sensed(q, v)), []
        for tick in range(300):
            t = DT * tick
            q[7:10] = q_stand()[:3] + 0.3 * np.sin(20.0 * t) * np.array([0.2, 1.0, -0.5])
            v[6:9] = 6.0 * np.cos(20.0 * t) * np.array([0.2, 1.0, -0.5])
            step(state, sensed(q, v), np.array([trust, 1.0, 1.0, 1.0]))
            speeds.append(np.abs(state.velocity).max())
        worst.append(max(speeds))
    assert worst[0] < 1e-3
    assert worst[1] > 0.05  # the data would have misled


@given(st.integers(0, 2**31))
@settings(deadline=None, max_examples=10)
def test_the_covariance_stays_symmetric_and_positive_definite(seed: int) -> None:
    random = np.random.default_rng(seed)
    q, v = standing()
    state, trust = begun(sensed(q, v)), ALL
    for tick in range(300):
        if tick % 50 == 0:
            trust = random.choice([0.0, 0.02, 0.5, 1.0], size=4)
        noisy = q.copy()
        noisy[7:] += random.normal(scale=0.1, size=12)
        state.dt = random.choice([0.001, 0.02])
        rates, jolt = random.normal(scale=3.0, size=18), random.normal(scale=20.0, size=3)
        step(state, sensed(noisy, rates, jolt), trust)
        np.testing.assert_array_equal(state.covariance, state.covariance.T)
        assert np.linalg.eigvalsh(state.covariance).min() > 0.0
    assert np.isfinite(state.velocity).all()


def test_trust_rises_and_falls_within_stance_and_needs_a_load() -> None:
    state = blank()
    state.stance, state.foot_force, trust = [1.0, 0.0, 0.0, 1.0], [40.0, 40.0, 40.0, 9.9], []
    for state.progress in (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.999):
        trust.append(foot_trust(state))
    of_stance = np.array(trust)[:, 0]
    assert (np.diff(of_stance[:4]) > 0.0).all()
    assert (np.diff(of_stance[5:]) < 0.0).all()
    assert of_stance[4] == 1.0
    assert 0.0 <= of_stance.min() <= of_stance[0] < 0.05
    assert not np.array(trust)[:, 1:].any()


@pytest.mark.parametrize("seed", range(2))
def test_the_truth_is_taken_over_as_it_is_and_the_filter_goes_on_from_it(seed: int) -> None:
    """Of the robot of that name, whatever its IMU says."""
    random = np.random.default_rng(seed)
    q, v = standing()
    q[:3] += random.uniform(-1.0, 1.0, 3)
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*random.uniform(-0.5, 0.5, 3))).coeffs()
    v[:] = random.uniform(-1.0, 1.0, 18)
    expected, sensors = pose_of(q, v), sensed(q, v)
    mine = (expected.position, expected.quat_wxyz, expected.velocity, expected.R @ expected.omega)
    p, quat, v_trunk, omega = (np.stack([np.eye(1, len(part))[0], part]) for part in mine)
    loads, none = np.zeros((2, 4, 3)), np.zeros(1)
    truth = Truth(0, 0, ("r1", "r2"), p, quat, v_trunk, omega, loads, none, none)
    gains, walking = gains_row(Config()), np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])
    tilted = sensors.imu_quat_wxyz + np.array([0.0, 0.05, -0.02, 0.1])
    read = replace(sensors, imu_quat_wxyz=tilted)
    known = estimate(None, read, walking, DT, gains, truth_row(truth, "r2"))
    for name in ("position", "velocity", "R", "omega", "p_foot", "q", "v"):
        np.testing.assert_allclose(getattr(known, name), getattr(expected, name), atol=1e-12)
    after = estimate(known, sensors, walking, DT, gains)
    np.testing.assert_allclose(after.position, known.position + DT * known.velocity, atol=1e-4)
    np.testing.assert_allclose(after.velocity, known.velocity, atol=1e-2)


@given(st.integers(0, 2**31), st.floats(-3.0, 3.0))
@settings(deadline=None, max_examples=40)
def test_outputs_are_those_of_the_yaw_frame(seed: int, ground: float) -> None:
    pose = random_pose(np.random.default_rng(seed), tilt=1.0)
    pose.ground_height = ground
    roll, pitch, yaw = pin.rpy.matrixToRpy(pose.R)
    velocity = pin.utils.rotate("z", yaw).T @ pose.velocity
    wz = (pose.R @ pose.omega)[2]
    expected = [pose.position[2] - ground, velocity[0], velocity[1], roll, pitch, wz]
    np.testing.assert_allclose(outputs_at(pose), expected, atol=1e-9)


def without_error(R: Array, accel: Array, error: Array) -> tuple[Array, Array]:
    """Attitude and specific force of an IMU that gives R and `accel`, without its error."""
    x, y, z, w = pin.Quaternion(R).coeffs()
    state = blank()
    state.quat_wxyz, state.accel, state.imu_error = (w, x, y, z), accel, error
    take_imu_error_off(state)
    w, x, y, z = state.quat_wxyz
    return pin.Quaternion(w, x, y, z).normalized().toRotationMatrix(), state.accel


def near_level(rng: np.random.Generator) -> Array:
    roll, pitch = rng.uniform(-0.2, 0.2, 2)
    return np.array(pin.rpy.rpyToMatrix(roll, pitch, rng.uniform(-np.pi, np.pi)))


@given(st.integers(0, 10_000), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
@settings(deadline=None)
def test_of_a_horizontal_error_the_attitude_takes_its_share(
    seed: int, roll: float, pitch: float
) -> None:
    """A tilt alone is undone by it; the accelerometer takes the rest, and all that is vertical."""
    R = near_level(np.random.default_rng(seed))
    error = GRAVITY / TILT_SHARE * np.array([pitch, -roll, 0.0]) + np.array([0.0, 0.0, 0.1])
    measured = UP + error * [1.0 - TILT_SHARE, 1.0 - TILT_SHARE, 1.0]
    found, force = without_error(R @ pin.exp3(np.array([roll, pitch, 0.0])), measured, error)
    np.testing.assert_allclose(found, R, atol=2e-4)
    np.testing.assert_allclose(force, UP, atol=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_an_error_is_found_from_what_the_legs_deny(seed: int) -> None:
    """What seems to accelerate a trunk at rest is taken back by its legs, in all three axes."""
    rng, state = np.random.default_rng(seed), blank()
    tilt, bias = 0.01 * rng.standard_normal(2), 0.15 * rng.standard_normal(3)
    R = near_level(rng)
    measured, accel = R @ pin.exp3(np.array([*tilt, 0.0])), R.T @ UP + bias
    for _ in range(4000):
        state.R, force = without_error(measured, accel, state.imu_error)
        seeming = state.R @ force - UP
        update_imu_error(state, -DT * seeming, 5.0)
    np.testing.assert_allclose(seeming, 0.0, atol=0.02)


def test_an_estimate_of_the_error_stays_small_and_none_is_made_without_a_time_constant() -> None:
    state = blank()
    state.R = np.eye(3)
    update_imu_error(state, np.ones(3), 0.0)
    np.testing.assert_array_equal(state.imu_error, np.zeros(3))
    for _ in range(100):
        update_imu_error(state, np.array([10.0, -10.0, 10.0]), 1.0)
    np.testing.assert_allclose(state.imu_error, [-0.5, 0.5, -0.5])
