"""The estimator on data whose truth is known, synthesised through Pinocchio."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.estimator import (
    Estimate,
    filter_at,
    filter_noise,
    foot_trust,
    trunk_from_truth,
)
from quadriga.agents.controller.maths.rotation import rotation_matrix
from quadriga.shared.config.sections import EstimatorConfig
from quadriga.shared.messages import State, Truth
from quadriga.shared.robots.conventions import GRAVITY, N_JOINTS, Array
from tests.a1 import FOOT_RADIUS, GEOMETRY, STAND_HEIGHT, q_stand, standing_filter
from tests.agents.controller.parts import RULE, estimate_trunk
from tests.agents.controller.poses import FEET, MODEL, pose_of

NOISE = filter_noise(EstimatorConfig())
ALL = np.ones(4)
DT = 1e-3


def sensed(q: Array, v: Array, acceleration: Array | None = None) -> State:
    """What perfect sensors measure at Pinocchio's (q, v); `acceleration` of the trunk, world."""
    R = pin.Quaternion(q[3:7]).matrix()
    force = np.array([0.0, 0.0, GRAVITY]) + (0.0 if acceleration is None else acceleration)
    quat = np.array([q[6], q[3], q[4], q[5]])
    return State(
        0,
        0,
        q[7:].copy(),
        v[6:].copy(),
        np.zeros(N_JOINTS),
        quat,
        v[3:6].copy(),
        R.T @ force,
        np.full(4, 30.0),
    )


def standing() -> tuple[Array, Array]:
    q = np.concatenate([[0.0, 0.0, STAND_HEIGHT, 0.0, 0.0, 0.0, 1.0], q_stand()])
    return q, np.zeros(18)


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
    state = sensed(*standing())
    memory = standing_filter(state)
    for _ in range(1000):
        memory, estimate = estimate_trunk(memory, state, ALL, NOISE, DT)
    np.testing.assert_allclose(estimate.velocity, 0.0, atol=1e-12)
    np.testing.assert_allclose(estimate.position, [0.0, 0.0, STAND_HEIGHT], atol=1e-12)
    np.testing.assert_allclose(estimate.p_foot[:, 2], FOOT_RADIUS, atol=1e-12)


def test_an_error_of_the_accelerometer_becomes_no_speed() -> None:
    """Of a robot that stands; the error is found, without that it is 92 mm/s for each m/s²."""
    state = sensed(*standing(), np.array([0.1, -0.1, 0.15]))
    speeds = []
    for imu_error in (None, np.zeros(4)):
        memory = standing_filter(state)
        for _ in range(3000):
            memory, estimate = estimate_trunk(memory, state, ALL, NOISE, DT, imu_error)
        speeds.append(np.abs(estimate.velocity))
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
    known = filter_at(pose_of(*next(motion.walk(1))).estimate)
    start = standing_filter(sensed(*next(motion.walk(1))))
    for q, v in motion.walk(200):
        known, tracked = estimate_trunk(known, sensed(q, v), ALL, NOISE, DT)
        np.testing.assert_allclose(tracked.velocity, velocity, atol=1e-3)
        start, caught_up = estimate_trunk(start, sensed(q, v), ALL, NOISE, DT)
        np.testing.assert_allclose(
            caught_up.p_foot - caught_up.position, pose_of(q, v).estimate.p_foot - q[:3], atol=1e-12
        )
    np.testing.assert_allclose(tracked.position, q[:3], atol=1e-3)
    assert np.linalg.norm(caught_up.velocity - velocity) < 0.05 * np.linalg.norm(velocity)


def test_acceleration_between_two_corrections_is_the_accelerometers() -> None:
    """No foot is trusted: what remains is integration of the specific force."""
    q, v = standing()
    state = sensed(q, v, np.array([1.0, -2.0, 0.5]))
    memory = standing_filter(state)
    for _ in range(100):
        memory, estimate = estimate_trunk(memory, state, np.zeros(4), NOISE, DT)
    np.testing.assert_allclose(estimate.velocity, [0.1, -0.2, 0.05], rtol=1e-4)


@pytest.mark.parametrize("trust", [0.0, 1.0])
def test_a_foot_in_swing_is_not_trusted(trust: float) -> None:
    """One leg swings while three stand: it pulls the velocity along only if it is an anchor."""
    q, v = standing()
    memory = standing_filter(sensed(q, v))
    worst = 0.0
    for tick in range(300):
        t = DT * tick
        q[7:10] = q_stand()[:3] + 0.3 * np.sin(20.0 * t) * np.array([0.2, 1.0, -0.5])
        v[6:9] = 6.0 * np.cos(20.0 * t) * np.array([0.2, 1.0, -0.5])
        state = sensed(q, v)
        memory, estimate = estimate_trunk(
            memory, state, np.array([trust, 1.0, 1.0, 1.0]), NOISE, DT
        )
        worst = max(worst, float(np.abs(estimate.velocity).max()))
    if trust:
        assert worst > 0.05  # the data would have misled
    else:
        assert worst < 1e-3


@given(
    st.integers(0, 2**31), st.lists(st.sampled_from([0.0, 0.02, 0.5, 1.0]), min_size=4, max_size=4)
)
@settings(deadline=None, max_examples=10)
def test_the_covariance_stays_symmetric_and_positive_definite(
    seed: int, first: list[float]
) -> None:
    random = np.random.default_rng(seed)
    q, v = standing()
    memory, trust = standing_filter(sensed(q, v)), np.array(first)
    for tick in range(300):
        if tick % 50 == 49:
            trust = random.choice([0.0, 0.02, 1.0], size=4)
        noisy = q.copy()
        noisy[7:] += random.normal(scale=0.1, size=12)
        state = sensed(noisy, random.normal(scale=3.0, size=18), random.normal(scale=20.0, size=3))
        dt = float(random.choice([0.001, 0.02]))
        memory, estimate = estimate_trunk(memory, state, trust, NOISE, dt)
        np.testing.assert_array_equal(memory.covariance, memory.covariance.T)
        assert np.linalg.eigvalsh(memory.covariance).min() > 0.0
    assert np.isfinite(estimate.velocity).all()


def test_trust_rises_and_falls_within_stance() -> None:
    stance, force = np.array([1.0, 0.0, 0.0, 1.0]), np.full(4, 40.0)
    progress = [0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.999]
    trust = np.array([foot_trust(stance, p, force, 0.3, 10.0) for p in progress])
    assert (np.diff(trust[:4, 0]) > 0.0).all()
    assert (np.diff(trust[5:, 0]) < 0.0).all()
    assert trust[4, 0] == 1.0
    assert trust.min() >= 0.0
    assert trust[0, 0] < 0.05
    assert not trust[:, 1:3].any()  # of legs in swing
    np.testing.assert_array_equal(foot_trust(stance, 0.0, force, 0.0, 10.0), stance)


def test_a_foot_without_load_is_not_trusted() -> None:
    trust = foot_trust(np.ones(4), 0.5, np.array([9.9, 10.0, 0.0, 50.0]), 0.3, 10.0)
    np.testing.assert_array_equal(trust, [0.0, 1.0, 0.0, 1.0])


def moving(seed: int) -> tuple[Truth, State, Estimate]:
    """A second robot's truth, its sensors, and what both mean according to Pinocchio."""
    random = np.random.default_rng(seed)
    q, v = standing()
    q[:3] += random.uniform(-1.0, 1.0, 3)
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*random.uniform(-0.5, 0.5, 3))).coeffs()
    v[:] = random.uniform(-1.0, 1.0, 18)
    pose = pose_of(q, v)
    row = (pose.estimate.position, pose.estimate.quat_wxyz, pose.estimate.velocity)
    omega = pose.estimate.R @ pose.estimate.omega
    first = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
    both = (np.array([a, b]) for a, b in zip(first, (*row, omega), strict=True))
    base_pos, base_quat, base_vel, base_omega = both
    truth = Truth(
        0,
        0,
        ("r1", "r2"),
        base_pos,
        base_quat,
        base_vel,
        base_omega,
        np.zeros((2, 4, 3)),
        np.zeros(1),
        np.zeros(1),
    )
    return truth, sensed(q, v), pose.estimate


@pytest.mark.parametrize("seed", range(3))
def test_the_truth_is_taken_over_as_it_is(seed: int) -> None:
    truth, state, expected = moving(seed)
    estimate = trunk_from_truth(truth, "r2", state, GEOMETRY, RULE)
    for name in ("position", "velocity", "R", "omega", "p_foot", "q_joint", "v_joint"):
        np.testing.assert_allclose(getattr(estimate, name), getattr(expected, name), atol=1e-12)


def test_the_true_attitude_is_taken_whatever_the_imu_says() -> None:
    truth, state, _ = moving(4)
    tilted = state.imu_quat_wxyz + np.array([0.0, 0.05, -0.02, 0.1])
    estimate = trunk_from_truth(truth, "r2", replace(state, imu_quat_wxyz=tilted), GEOMETRY, RULE)
    np.testing.assert_allclose(rotation_matrix(estimate.quat_wxyz), estimate.R, atol=1e-12)


def test_a_robot_is_found_in_the_truth_by_its_name() -> None:
    truth, state, expected = moving(3)
    rows = ("base_pos", "base_quat_wxyz", "base_vel", "base_omega")
    turned = replace(
        truth, robots=("r2", "r1"), **{name: getattr(truth, name)[::-1] for name in rows}
    )
    estimate = trunk_from_truth(turned, "r2", state, GEOMETRY, RULE)
    np.testing.assert_allclose(estimate.position, expected.position, atol=1e-12)
    np.testing.assert_allclose(estimate.omega, expected.omega, atol=1e-12)


def test_the_filter_goes_on_from_a_known_state() -> None:
    """A tick without truth is a tick of the filter from the last truth, not from the start."""
    _, state, known = moving(5)
    _, estimate = estimate_trunk(filter_at(known), state, np.zeros(4), NOISE, DT)
    np.testing.assert_allclose(estimate.position, known.position + DT * known.velocity, atol=1e-4)
    np.testing.assert_allclose(estimate.velocity, known.velocity, atol=1e-2)
