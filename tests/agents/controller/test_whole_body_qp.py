"""The reduced QP against the full one, its limits, its optimality, and its refusals."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls

from quadriga.agents.controller.whole_body_qp import (
    QP,
    WholeBodySolution,
    build_qp,
    solve_qp,
    torque_bounds,
)
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.robots.torque_speed import motor_curves
from quadriga.sim_server.world.motors import Motors
from tests.a1 import TORQUE_LIMIT, TOTAL_MASS
from tests.agents.estimator.poses import FEET, MODEL, gains_of, random_pose, standing_pose, terms_of
from tests.sim_server.standing import IDEAL_MOTORS, command

PLAIN = {"force_min": 2.0, "tilt_length": 1.0, "swing_weight": 1.0}
WEIGHTS = gains_of(**PLAIN)
BY_LENGTH = gains_of(**PLAIN | {"tilt_length": 0.15, "swing_weight": 0.3})
STANCES = [np.array(legs, dtype=float) for legs in itertools.product((0, 1), repeat=4)]
ALL = np.ones(4)
BOUNDS = np.stack([-A1.torque_limit, A1.torque_limit])
TROT = np.array([1.0, 0.0, 0.0, 1.0])


def asked(pose: Any, contact: Array, acc: Array | float = 0.0) -> Any:
    """The pose, asked for an acceleration of its trunk on these feet, which share its weight."""
    pose.contact, pose.acc_des, pose.swing_acc_des, pose.force_des = contact, acc, 0.0, 0.0
    pose.force_des[:, 2] = contact * TOTAL_MASS * GRAVITY / max(1.0, contact.sum())
    return pose


def randomly_asked(
    random: np.random.Generator, contact: Array, size: float, pose: Any = None
) -> Any:
    pose = asked(random_pose(random) if pose is None else pose, contact)
    pose.acc_des = size * random.normal(size=6)
    pose.swing_acc_des = 5.0 * size * random.normal(size=(4, 3))
    pose.force_des += size * random.normal(size=(4, 3))
    return pose


def solution_of(pose: Any, gains: Any = WEIGHTS, bounds: Array = BOUNDS) -> WholeBodySolution:
    row = np.empty(QP.itemsize // 8)
    return solve_qp(row, build_qp(terms_of(pose.q, pose.v), pose, gains, bounds.copy(), row))


def check_limits(solution: WholeBodySolution) -> None:
    contact = solution.contact
    assert np.abs(solution.tau).max() <= TORQUE_LIMIT
    assert not solution.force[contact < 0.5].any()
    for fx, fy, fz in solution.force[contact > 0.5]:
        assert fz >= WEIGHTS.force_min - 1e-6
        assert np.hypot(fx, fy) <= WEIGHTS.mu * fz + 1e-6


@pytest.mark.parametrize("contact", STANCES, ids=lambda c: "".join(str(int(x)) for x in c))
@pytest.mark.parametrize("size", [1.0, 20.0])
@pytest.mark.parametrize("weights", [WEIGHTS, BY_LENGTH], ids=["plain", "by_length"])
def test_the_reduced_problem_is_the_full_one(contact: Array, size: float, weights: Any) -> None:
    """For any torques it has the forces, the defect, the cost and the limits of the full problem.

    v̇ = M⁻¹ (S τ + J_cᵀ f − h), the feet in contact do not accelerate, and the defect is what the
    outputs (trunk, then the other feet) miss of their desired accelerations, all by Pinocchio.
    """
    random = np.random.default_rng(round(size) + int(contact @ [1, 2, 4, 8]))
    pose, data = randomly_asked(random, contact, size), MODEL.createData()
    qp, on, R = solution_of(pose, weights), contact > 0.5, pose.R
    M = pin.crba(MODEL, data, pose.q)
    M_inverse = np.linalg.inv(np.triu(M) + np.triu(M, 1).T)
    nle = pin.rnea(MODEL, data, pose.q, pose.v, np.zeros(18)).copy()
    pin.computeJointJacobians(MODEL, data, pose.q)
    pin.forwardKinematics(MODEL, data, pose.q, pose.v, np.zeros(18))
    pin.updateFramePlacements(MODEL, data)
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    J = np.array([pin.getFrameJacobian(MODEL, data, foot, world)[:3] for foot in FEET])
    drift = np.array(
        [pin.getFrameClassicalAcceleration(MODEL, data, foot, world).linear for foot in FEET]
    )
    n_f, n_h = 3 * qp.feet, 18 - 3 * qp.feet
    W = np.repeat((1.0, weights.tilt_length, weights.swing_weight), (3, 3, n_h - 6))
    full, reduced = [], []
    for tau in (qp.tau, *(qp.tau + 2.0 * random.normal(size=(3, 12)))):
        f, defect = qp.A[:n_f] @ tau + qp.a0[:n_f], qp.B[:n_h] @ tau + qp.defect0[:n_h]
        driven = np.concatenate([np.zeros(6), tau]) + J[on].reshape(n_f, 18).T @ f
        a = M_inverse @ (driven - nle)
        np.testing.assert_allclose(J[on] @ a + drift[on], 0.0, atol=1e-5)
        linear = R @ (a[:3] + np.cross(pose.v[3:6], pose.v[:3])) - pose.acc_des[:3]
        np.testing.assert_allclose(defect[:3], linear, atol=1e-5)
        np.testing.assert_allclose(defect[3:6], R @ a[3:6] - pose.acc_des[3:], atol=1e-5)
        swing = J[~on] @ a + drift[~on] - pose.swing_acc_des[~on]
        np.testing.assert_allclose(defect[6:], swing.ravel(), atol=1e-5)
        f_error = f - pose.force_des[on].ravel()
        parts = (tau @ tau, f_error @ f_error, np.sum((W * defect) ** 2))
        gammas = (weights.gamma_tau, weights.gamma_force, weights.gamma_defect)
        full.append(0.5 * np.dot(gammas, parts))
        reduced.append(0.5 * tau @ qp.H @ tau + qp.g @ tau)
        fx, fy, fz = f.reshape(-1, 3).T
        along = weights.mu / np.sqrt(2) * fz
        limits = [fz - weights.force_min, along - fx, along + fx, along - fy, along + fy]
        slack = qp.C[: 5 * qp.feet] @ tau - qp.lower[12 : 12 + 5 * qp.feet]
        np.testing.assert_allclose(slack.reshape(-1, 5).T, limits, atol=1e-6)
    assert np.trace(qp.H) == pytest.approx(12.0)
    scales = np.diff(reduced) / np.diff(full)
    np.testing.assert_allclose(scales, scales[0], rtol=1e-5)
    np.testing.assert_allclose(qp.force[on].ravel(), qp.A[:n_f] @ qp.tau + qp.a0[:n_f], atol=1e-9)
    assert scales[0] > 0.0
    check_limits(qp)


def test_torques_keep_to_bounds_that_differ_up_and_down() -> None:
    """As those of a motor that turns: less torque drives it on than brakes it."""
    random, active = np.random.default_rng(5), 0
    for _ in range(60):
        bounds = np.array([-random.uniform(4.0, 33.0, 12), random.uniform(4.0, 33.0, 12)])
        pose = randomly_asked(random, TROT, 20.0, standing_pose(0.7))
        tau = solution_of(pose, bounds=bounds).tau
        assert (tau >= bounds[0] - 1e-6).all()
        assert (tau <= bounds[1] + 1e-6).all()
        active += int((np.abs(tau - bounds) < 1e-6).any())
    assert active > 10, "most of these ask for more than a motor has"


@given(st.integers(0, 2**31), st.sampled_from(STANCES), st.floats(0.1, 50.0))
@settings(deadline=None, max_examples=60)
def test_every_answer_is_optimal(seed: int, contact: Array, size: float) -> None:
    """KKT: the gradient is a non-negative combination of the normals of the active limits."""
    qp = solution_of(randomly_asked(np.random.default_rng(seed), contact, size))
    tau, cones = qp.tau, 5 * qp.feet
    assert qp.solved
    gradient = qp.H @ tau + qp.g
    rows = np.vstack([qp.C[:cones], np.eye(12), -np.eye(12)])
    least = np.concatenate([qp.lower[12 : 12 + cones], np.full(24, -TORQUE_LIMIT)])
    slack = rows @ tau - least
    assert slack.min() > -1e-6
    active = rows[slack < 1e-6]
    scale = max(1.0, float(np.linalg.norm(qp.g)))
    residual = nnls(active.T, gradient)[1] if len(active) else np.linalg.norm(gradient)
    assert residual < 1e-6 * scale
    if qp.status == "unconstrained":
        assert np.linalg.norm(gradient) < 1e-9 * scale
    check_limits(qp)


@pytest.mark.parametrize("contact", [ALL, TROT])
def test_what_cannot_be_done_is_refused_by_name(contact: Array) -> None:
    """Feet pressed down with more than the motors can give."""
    weights = gains_of(**PLAIN | {"force_min": 5000.0})
    solution = solution_of(asked(standing_pose(), contact), weights)
    assert solution.status.startswith("infeasible:")
    assert not solution.solved
    np.testing.assert_array_equal(solution.tau, np.zeros(12))
    assert np.isfinite(solution.force).all()
    assert np.isfinite(solution.defect).all()


@pytest.mark.parametrize(
    ("places", "value"),
    [(slice(22, 25), 1e200), (slice(25, 37), 1e160), (slice(0, 3), np.nan)],
    ids=["rate of the trunk", "rates of the joints", "position"],
)
def test_numbers_beyond_all_bounds_are_refused_by_name(places: slice, value: float) -> None:
    pose = standing_pose()
    numbers = np.concatenate([pose.q, pose.v])
    numbers[places] = value
    pose.q, pose.v = numbers[:19], numbers[19:]
    solution = solution_of(asked(pose, ALL))
    assert solution.status == "infeasible:singular"
    np.testing.assert_array_equal(solution.tau, np.zeros(12))


def test_a_problem_without_curvature_gives_numbers_within_the_limits() -> None:
    """Neither torques nor forces weighed: on four feet the six outputs leave τ undetermined."""
    weights = gains_of(**PLAIN | {"gamma_tau": 0.0, "gamma_force": 0.0})
    tau = solution_of(asked(standing_pose(), ALL), weights).tau
    assert np.isfinite(tau).all()
    assert np.abs(tau).max() <= TORQUE_LIMIT


@given(
    st.integers(0, 2**31),
    st.sampled_from(STANCES),
    arrays(np.float64, 12, elements=st.floats(-3.1, 3.1)),
    st.floats(0.0, 30.0),
    st.floats(0.0, 1000.0),
)
@settings(deadline=None, max_examples=60)
def test_no_pose_and_nothing_asked_gives_anything_but_a_number(
    seed: int, contact: Array, joints: Array, speed: float, size: float
) -> None:
    """Legs straight, folded or wound up, falling and tumbling: torques, or a named refusal."""
    random = np.random.default_rng(seed)
    pose = random_pose(random, tilt=1.5, speed=speed)
    pose.q[7:] = joints
    solution = solution_of(randomly_asked(random, contact, size, pose))
    for array in (solution.tau, solution.force, solution.defect):
        assert np.isfinite(array).all()
    if solution.solved:
        check_limits(solution)


@pytest.mark.parametrize("torque_speed", [False, True])
def test_joints_that_stand_and_ideal_motors_have_the_full_torque(torque_speed: bool) -> None:
    curves, rates = motor_curves(A1, torque_speed=torque_speed), np.zeros(12)
    np.testing.assert_array_equal(torque_bounds(rates, curves), BOUNDS)
    at_speed = torque_bounds(rates + 50.0, curves)
    assert (at_speed == BOUNDS).all() == (not torque_speed)


@pytest.mark.parametrize("rate", [-25.0, -14.0, -9.0, 3.0, 12.0, 17.0])
def test_bounds_are_what_the_worlds_motors_give_but_never_less_than_a_quarter(rate: float) -> None:
    bounds = torque_bounds(np.full(12, rate), motor_curves(A1, torque_speed=True))
    for row, tau in ((0, -99.0), (1, 99.0)):
        motors = Motors(A1, replace(IDEAL_MOTORS, torque_speed=True), 1, command())
        sent, rates = motors.send(command(tau=tau).row[None]), np.full((1, 18), rate)
        motors.drive(sent, np.zeros((1, 19)), rates, np.ones((1, 12)))
        least = 0.25 * A1.torque_limit * np.sign(tau)
        expected = np.where(np.abs(motors.torque[0]) < np.abs(least), least, motors.torque[0])
        np.testing.assert_allclose(bounds[row], expected)
