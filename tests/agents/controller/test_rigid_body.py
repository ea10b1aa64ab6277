"""Rigid-body terms against Pinocchio, loops over small matrices against numpy."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.rigid_body import (
    add_gram,
    cholesky,
    cholesky_solve,
    product,
    symmetrise,
    times,
    transposed_times,
)
from quadriga.agents.controller.swing import foot_velocities
from quadriga.agents.estimator.leg_dynamics import rigid_body
from quadriga.shared.robots.a1 import A1
from tests.agents.estimator.poses import FEET, MODEL, random_pose, terms_of

size = st.integers(1, 18)


@pytest.mark.parametrize("seed", range(3))
def test_terms_are_those_of_the_equation_of_motion(seed: int) -> None:
    """Of an attitude of any norm."""
    pose, data = random_pose(np.random.default_rng(seed), tilt=1.0), MODEL.createData()
    q = pose.q.copy()
    q[3:7] *= 1.01
    terms = terms_of(q, pose.v)
    M = pin.crba(MODEL, data, pose.q)
    M = np.triu(M) + np.triu(M, 1).T
    np.testing.assert_allclose(terms.M_inverse @ M, np.eye(18), atol=1e-9)
    nle = pin.rnea(MODEL, data, pose.q, pose.v, np.zeros(18))
    np.testing.assert_allclose(terms.nle, nle, atol=1e-10)
    np.testing.assert_allclose(terms.v, pose.v, atol=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_jacobians_give_the_velocities_of_the_feet(seed: int) -> None:
    """A joint's column is the spatial velocity it gives to all that it carries."""
    pose, data = random_pose(np.random.default_rng(seed)), MODEL.createData()
    found = foot_velocities(terms_of(pose.q, pose.v).J, pose.v, pose.p_foot)
    pin.forwardKinematics(MODEL, data, pose.q, pose.v)
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    expected = [pin.getFrameVelocity(MODEL, data, foot, world).linear for foot in FEET]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_the_derivative_of_the_jacobians_is_their_difference_in_time() -> None:
    pose, dt, data = random_pose(np.random.default_rng(7)), 1e-6, MODEL.createData()
    before, after = (
        pin.computeJointJacobians(MODEL, data, pin.integrate(MODEL, pose.q, h * pose.v)).copy()
        for h in (-dt, dt)
    )
    found = terms_of(pose.q, pose.v).dJ
    np.testing.assert_allclose(found, (after - before) / (2 * dt), atol=1e-6)


def test_rotors_are_felt_by_their_own_joints_alone() -> None:
    pose = random_pose(np.random.default_rng(0), tilt=1.0)
    terms = terms_of(pose.q, pose.v, 3.0, rigid_body(A1, rotors=True).links)
    bare = terms_of(pose.q, pose.v, 3.0)
    M, without = np.linalg.inv(terms.M_inverse), np.linalg.inv(bare.M_inverse)
    np.testing.assert_allclose(M - without, np.diag([*[0.0] * 6, *A1.rotor_inertias]), atol=1e-9)
    np.testing.assert_array_equal(terms.nle, bare.nle)


@given(m=size, k=size, n=size, seed=st.integers(0, 2**32 - 1))
@settings(deadline=None)
def test_products(m: int, k: int, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, B, x, y = rng.normal(size=(m, k)), rng.normal(size=(k, n)), *rng.normal(size=(2, 18))
    np.testing.assert_allclose(times(A, x[:k]), A @ x[:k], atol=1e-12)
    np.testing.assert_allclose(transposed_times(A, y[:m]), A.T @ y[:m], atol=1e-12)
    np.testing.assert_allclose(product(A, B), A @ B, atol=1e-12)
    H = np.zeros((k, k))
    add_gram(2.5, A, H)
    symmetrise(H)
    np.testing.assert_allclose(H, 2.5 * A.T @ A, atol=1e-12)


@given(n=size, m=size, seed=st.integers(0, 2**32 - 1))
@settings(deadline=None)
def test_solutions(n: int, m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n + 2))
    H, B = root @ root.T + np.eye(n), rng.normal(size=(n, m))
    L = cholesky(np.tril(H))  # only the lower triangle is read
    np.testing.assert_allclose(L @ L.T, H, atol=1e-11)
    X = B.copy()
    cholesky_solve(L, X)
    np.testing.assert_allclose(H @ X, B, atol=1e-9)


@pytest.mark.parametrize("H", [[[0.0]], [[1.0, 2.0], [2.0, 1.0]], [[np.nan]]])
def test_what_is_not_positive_definite_has_no_factor(H: list[list[float]]) -> None:
    assert np.isnan(cholesky(np.array(H))).any()
