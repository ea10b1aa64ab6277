"""The reduced QP against the full one, its limits, its optimality, and its refusals."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls

from quadriga.agents.controller.whole_body.assembly import build
from quadriga.agents.controller.whole_body.problem import (
    Goal,
    Weights,
    WholeBodyProblem,
    WholeBodySolution,
)
from quadriga.agents.controller.whole_body.solution import solve_goal
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import TORQUE_LIMIT, TOTAL_MASS
from tests.agents.controller.full_qp import desired, dynamics, solve_full
from tests.agents.controller.poses import Pose, random_pose, standing_pose

WEIGHTS = Weights(1e2, 1e3, 1e6, 0.6, 2.0)
BY_LENGTH = Weights(1e2, 1e3, 1e6, 0.6, 2.0, tilt_length=0.15, swing_weight=0.3)
STANCES = [np.array(legs, dtype=float) for legs in itertools.product((0, 1), repeat=4)]
ALL = np.ones(4)
TROT = np.array([1.0, 0.0, 0.0, 1.0])
REST = np.zeros(6)


def goal_of(contact: Array, trunk: Array = REST, swing: Array | None = None) -> Goal:
    force = np.zeros((4, 3))
    force[:, 2] = contact * TOTAL_MASS * GRAVITY / max(1.0, contact.sum())
    return Goal(contact, trunk, np.zeros((4, 3)) if swing is None else swing, force)


def random_goal(random: np.random.Generator, contact: Array, size: float) -> Goal:
    goal = goal_of(contact, size * random.normal(size=6), 5.0 * size * random.normal(size=(4, 3)))
    return goal._replace(force=goal.force + size * random.normal(size=(4, 3)))


def problem_of(pose: Pose, goal: Goal, weights: Weights = WEIGHTS) -> WholeBodyProblem:
    return build(
        pose.terms(), pose.estimate.R, pose.estimate.p_foot, goal, weights, A1.torque_bounds.copy()
    )


def solution_of(pose: Pose, goal: Goal, weights: Weights = WEIGHTS) -> WholeBodySolution:
    return solve_goal(
        pose.terms(), pose.estimate.R, pose.estimate.p_foot, goal, weights, A1.torque_bounds.copy()
    )


def check_limits(solution: WholeBodySolution, goal: Goal, weights: Weights = WEIGHTS) -> None:
    assert np.abs(solution.tau).max() <= TORQUE_LIMIT
    in_contact = goal.contact > 0.5
    assert not solution.force[~in_contact].any()
    for fx, fy, fz in solution.force[in_contact]:
        assert fz >= weights.force_min - 1e-6
        assert np.hypot(fx, fy) <= weights.mu * fz + 1e-6


@pytest.mark.parametrize("contact", STANCES, ids=lambda c: "".join(str(int(x)) for x in c))
@pytest.mark.parametrize("size", [1.0, 20.0])
@pytest.mark.parametrize("weights", [WEIGHTS, BY_LENGTH], ids=["plain", "by_length"])
def test_the_reduced_problem_is_the_full_one(contact: Array, size: float, weights: Weights) -> None:
    """Torques, forces and defect of the formulation with 12 + 3 n_c + n_h variables."""
    random = np.random.default_rng(round(size) + int(contact @ [1, 2, 4, 8]))
    for _ in range(2):
        pose, goal = random_pose(random), random_goal(random, contact, size)
        solution = solution_of(pose, goal, weights)
        tau, force, defect = solve_full(pose, goal, weights)
        np.testing.assert_allclose(solution.tau, tau, atol=1e-5)
        np.testing.assert_allclose(solution.force[contact > 0.5].ravel(), force, atol=1e-4)
        np.testing.assert_allclose(solution.defect, defect, atol=1e-4)
        check_limits(solution, goal)


def test_torques_keep_to_bounds_that_differ_up_and_down() -> None:
    """As those of a motor that turns: less torque drives it on than brakes it."""
    random, active = np.random.default_rng(5), 0
    for _ in range(60):
        bounds = np.array([-random.uniform(4.0, 33.0, 12), random.uniform(4.0, 33.0, 12)])
        pose, goal = standing_pose(0.7), random_goal(random, TROT, 20.0)
        solution = solve_goal(
            pose.terms(), pose.estimate.R, pose.estimate.p_foot, goal, WEIGHTS, bounds
        )
        assert (solution.tau >= bounds[0] - 1e-6).all()
        assert (solution.tau <= bounds[1] + 1e-6).all()
        active += int((np.abs(solution.tau - bounds) < 1e-6).any())
    assert active > 10, "most of these goals ask for more than a motor has"


@pytest.mark.parametrize(
    ("trunk", "contact", "active"),
    [
        ([0.0, 0.0, 40.0, 0.0, 0.0, 0.0], TROT, "torque"),
        ([0.0, 0.0, 80.0, 0.0, 0.0, 0.0], ALL, "torque"),
        ([15.0, 0.0, 0.0, 0.0, 0.0, 0.0], ALL, "friction"),
        ([0.0, -15.0, 0.0, 0.0, 0.0, 0.0], TROT, "friction"),
        ([0.0, 0.0, -15.0, 0.0, 0.0, 0.0], ALL, "least force"),
    ],
)
def test_active_limits_are_those_of_the_full_problem(
    trunk: list[float], contact: Array, active: str
) -> None:
    pose, goal = standing_pose(0.7), goal_of(contact, np.array(trunk))
    solution = solution_of(pose, goal)
    assert solution.status == "constrained"
    check_limits(solution, goal)
    force = solution.force[contact > 0.5]
    bound = WEIGHTS.mu / np.sqrt(2) * force[:, 2]
    at_limit = {
        "torque": np.abs(solution.tau).max() > TORQUE_LIMIT - 1e-6,
        "friction": (np.abs(force[:, :2]).max(axis=1) > bound - 1e-6).any(),
        "least force": force[:, 2].min() < WEIGHTS.force_min + 1e-6,
    }
    assert at_limit[active]
    tau, full_force, _ = solve_full(pose, goal, WEIGHTS)
    np.testing.assert_allclose(solution.tau, tau, atol=1e-5)
    np.testing.assert_allclose(force.ravel(), full_force, atol=1e-4)


def test_what_cannot_be_had_together_is_weighed_by_the_length() -> None:
    """Two feet cannot turn the trunk about the line between them: what is given up for it?"""
    across = A1.feet_under_hips[0] / np.linalg.norm(A1.feet_under_hips[0])
    trunk = np.array([0.0, 0.0, 5.0, *(100.0 * across), 0.0])
    linear, angular = [], []
    for weights in (WEIGHTS, WEIGHTS._replace(tilt_length=0.15)):
        solution = solution_of(standing_pose(), goal_of(TROT, trunk), weights)
        assert solution.solved
        linear.append(np.linalg.norm(solution.defect[:3]))
        angular.append(np.linalg.norm(solution.defect[3:6]))
    assert linear[1] < 0.9 * linear[0]
    assert angular[1] > angular[0]


@given(st.integers(0, 2**31), st.sampled_from(STANCES), st.floats(0.1, 50.0))
@settings(deadline=None, max_examples=60)
def test_every_answer_is_optimal(seed: int, contact: Array, size: float) -> None:
    """KKT: the gradient is a non-negative combination of the normals of the active limits."""
    random = np.random.default_rng(seed)
    pose, goal = random_pose(random), random_goal(random, contact, size)
    problem = problem_of(pose, goal)
    solution = solution_of(pose, goal)
    tau, status = solution.tau, solution.status
    assert status in ("unconstrained", "constrained")
    gradient = problem.H @ tau + problem.g
    rows = np.vstack([problem.C, np.eye(12), -np.eye(12)])
    slack = rows @ tau - np.concatenate([problem.c, np.full(24, -TORQUE_LIMIT)])
    assert slack.min() > -1e-6
    active = rows[slack < 1e-6]
    scale = max(1.0, float(np.linalg.norm(problem.g)))
    residual = nnls(active.T, gradient)[1] if len(active) else np.linalg.norm(gradient)
    assert residual < 1e-6 * scale
    if status == "unconstrained":
        assert np.linalg.norm(gradient) < 1e-9 * scale
    check_limits(solution, goal)


@given(st.integers(0, 2**31), st.sampled_from(STANCES))
@settings(deadline=None, max_examples=30)
def test_forces_and_defect_obey_the_equation_of_motion(seed: int, contact: Array) -> None:
    """Feet in contact do not accelerate; the defect is what the outputs miss of their goal."""
    random = np.random.default_rng(seed)
    pose, goal = random_pose(random), random_goal(random, contact, 5.0)
    solution, dyn = solution_of(pose, goal), dynamics(pose, contact)
    force = solution.force[contact > 0.5].ravel()
    driven = np.concatenate([np.zeros(6), solution.tau]) + dyn.J_c.T @ force
    acceleration = dyn.M_inverse @ (driven - dyn.nle)
    np.testing.assert_allclose(dyn.J_c @ acceleration + dyn.d_c, 0.0, atol=1e-5)
    missed = dyn.J_h @ acceleration + dyn.d_h - desired(goal)
    np.testing.assert_allclose(solution.defect, missed, atol=1e-5)


def test_standing_needs_no_limits_and_carries_the_weight() -> None:
    solution = solution_of(standing_pose(), goal_of(ALL))
    assert solution.status == "unconstrained"
    np.testing.assert_allclose(
        solution.force.sum(axis=0), [0.0, 0.0, TOTAL_MASS * GRAVITY], atol=0.5
    )
    np.testing.assert_allclose(solution.defect, 0.0, atol=0.05)


def test_without_contact_only_the_feet_can_be_moved() -> None:
    swing = np.tile([1.0, -2.0, 3.0], (4, 1))
    solution = solution_of(
        standing_pose(), goal_of(np.zeros(4), np.array([0, 0, -9.81, 0, 0, 0.0]), swing)
    )
    assert solution.solved
    assert not solution.force.any()
    assert np.abs(solution.defect[:3]).max() < 2.0  # the trunk falls freely but for the legs' pull


@pytest.mark.parametrize("contact", [ALL, TROT])
def test_what_cannot_be_done_is_refused_by_name(contact: Array) -> None:
    """Feet pressed down with more than the motors can give."""
    weights = WEIGHTS._replace(force_min=5000.0)
    solution = solution_of(standing_pose(), goal_of(contact), weights)
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
    solution = solution_of(replace(pose, q=numbers[:19], v=numbers[19:]), goal_of(ALL))
    assert solution.status == "infeasible:singular"
    assert not solution.solved
    np.testing.assert_array_equal(solution.tau, np.zeros(12))


def test_a_problem_without_curvature_gives_numbers_within_the_limits() -> None:
    """Neither torques nor forces weighed: on four feet the six outputs leave τ undetermined."""
    weights = WEIGHTS._replace(gamma_tau=0.0, gamma_force=0.0)
    solution = solution_of(standing_pose(), goal_of(ALL), weights)
    assert np.isfinite(solution.tau).all()
    assert np.abs(solution.tau).max() <= TORQUE_LIMIT


@given(
    st.integers(0, 2**31),
    st.sampled_from(STANCES),
    arrays(np.float64, 12, elements=st.floats(-3.1, 3.1)),
    st.floats(0.0, 30.0),
    st.floats(0.0, 1000.0),
)
@settings(deadline=None, max_examples=60)
def test_no_pose_and_no_goal_gives_anything_but_a_number(
    seed: int, contact: Array, joints: Array, speed: float, size: float
) -> None:
    """Legs straight, folded or wound up, falling and tumbling: torques, or a named refusal."""
    random = np.random.default_rng(seed)
    start = random_pose(random, tilt=1.5, speed=speed)
    estimate = start.estimate._replace(q_joint=joints)
    goal = random_goal(random, contact, size)
    solution = solution_of(replace(start, estimate=estimate), goal)
    for array in (solution.tau, solution.force, solution.defect):
        assert np.isfinite(array).all()
    if solution.solved:
        check_limits(solution, goal)
