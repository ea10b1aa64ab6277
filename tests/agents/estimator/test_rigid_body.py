"""Terms of the rigid body and the ground's forces against Pinocchio, loops against numpy."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.swing import foot_velocities
from quadriga.agents.estimator.payload_friction import add_payload
from quadriga.agents.estimator.rigid_body import (
    add_gram,
    cholesky,
    cholesky_solve,
    foot_forces,
    link_table,
    product,
    reaction_torques,
    times,
)
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from tests.a1 import GEOMETRY, TOTAL_MASS, q_stand
from tests.agents.estimator.poses import FEET, GAINS, MODEL, random_pose, terms_of

size = st.integers(1, 18)
WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@pytest.mark.parametrize(("seed", "load"), [(0, 0.0), (1, 0.0), (2, 0.0), (0, 2.0), (1, 9.0)])
def test_terms_are_those_of_the_equation_of_motion(seed: int, load: float) -> None:
    """Of an attitude of any norm, and of a robot that carries a load on its trunk."""
    model, before = MODEL.copy(), GAINS.links.copy()
    point = pin.Inertia(load, np.array([0.0, 0.0, 0.08]), np.zeros((3, 3)))
    model.inertias[1] = model.inertias[1] + point
    pose, data = random_pose(np.random.default_rng(seed), tilt=1.0), model.createData()
    q = pose.q.copy()
    q[3:7] *= 1.01
    terms = terms_of(q, pose.v, load)
    M = pin.crba(model, data, pose.q)
    M = np.triu(M) + np.triu(M, 1).T
    np.testing.assert_allclose(terms.M_inverse @ M, np.eye(18), atol=1e-9)
    nle = pin.rnea(model, data, pose.q, pose.v, np.zeros(18))
    np.testing.assert_allclose(terms.nle, nle, atol=1e-10)
    assert add_payload(GAINS.links, load)[0, 0] == before[0, 0] + load
    np.testing.assert_array_equal(GAINS.links, before)


@pytest.mark.parametrize("seed", range(3))
def test_jacobians_give_the_velocities_of_the_feet_and_change_as_they_say(seed: int) -> None:
    """A joint's column is the spatial velocity it gives to all that it carries."""
    pose, dt, data = random_pose(np.random.default_rng(seed)), 1e-6, MODEL.createData()
    terms = terms_of(pose.q, pose.v)
    found = foot_velocities(terms.J, pose.v, pose.p_foot)
    pin.forwardKinematics(MODEL, data, pose.q, pose.v)
    expected = [pin.getFrameVelocity(MODEL, data, foot, WORLD).linear for foot in FEET]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    before, after = (
        pin.computeJointJacobians(MODEL, data, pin.integrate(MODEL, pose.q, h * pose.v)).copy()
        for h in (-dt, dt)
    )
    np.testing.assert_allclose(terms.dJ, (after - before) / (2 * dt), atol=1e-6)


def test_rotors_are_felt_by_their_own_joints_alone() -> None:
    pose, links = random_pose(np.random.default_rng(0), tilt=1.0), GAINS.links
    with_rotors = link_table(build_pinocchio_model(A1, rotors=True))
    terms, bare = (terms_of(pose.q, pose.v, 3.0, table) for table in (with_rotors, links))
    M, without = np.linalg.inv(terms.M_inverse), np.linalg.inv(bare.M_inverse)
    np.testing.assert_allclose(M - without, np.diag([*[0.0] * 6, *A1.rotor_inertias]), atol=1e-9)
    np.testing.assert_array_equal(terms.nle, bare.nle)


def contact_torques(q: Array, v: Array, a: Array, force: Array) -> Array:
    """Joint torques, (12,), of a motion while the ground presses on the feet, trunk frame."""
    data = MODEL.createData()
    R = pin.Quaternion(q[3:7]).matrix()
    tau = pin.rnea(MODEL, data, q, v, a)
    pin.computeJointJacobians(MODEL, data, q)
    pin.updateFramePlacements(MODEL, data)
    for frame, f in zip(FEET, force, strict=True):
        tau = tau - pin.getFrameJacobian(MODEL, data, frame, WORLD)[:3].T @ (R @ f)
    return np.array(tau[6:])


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=40)
def test_forces_are_found_in_any_motion_without_angular_acceleration(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose, force = random_pose(rng), rng.uniform(-100.0, 100.0, (4, 3))
    # Pinocchio's acceleration of the trunk is spatial: that of its origin less ω × v.
    a = np.concatenate([rng.uniform(-5.0, 5.0, 3), np.zeros(3), rng.uniform(-100.0, 100.0, 12)])
    linear = a[:3] + np.cross(pose.v[3:6], pose.v[:3])
    specific_force = linear + pose.R.T @ np.array([0.0, 0.0, GRAVITY])
    pose.tau_joint = contact_torques(pose.q, pose.v, a, force)
    static, inertial = reaction_torques(pose, a[6:], specific_force, GAINS.links)
    found = foot_forces(static + inertial, pose.q_joint, GEOMETRY)
    np.testing.assert_allclose(found, force, atol=1e-6)


def test_a_stretched_leg_tells_no_force() -> None:
    q = q_stand()
    q[1:3] = 0.0
    found = np.abs(foot_forces(np.ones(12), q, GEOMETRY))
    np.testing.assert_array_equal(found[0], np.zeros(3))
    assert found[1:].min() > 0.0


def test_another_kind_of_robot_is_refused() -> None:
    with pytest.raises(ConfigError, match="four legs with a hip that turns about x"):
        link_table(pin.buildSampleModelHumanoid())


def test_the_single_rigid_body_is_the_sum_of_its_links() -> None:
    """Steiner's theorem over all links in the nominal pose."""
    data, q = MODEL.createData(), pin.neutral(MODEL)
    q[7:] = q_stand()
    pin.forwardKinematics(MODEL, data, q)
    links = [(MODEL.inertias[i], data.oMi[i]) for i in range(1, MODEL.njoints)]
    mass = sum(link.mass for link, _ in links)
    com = sum(link.mass * (place * link.lever) for link, place in links) / mass
    inertia = np.zeros((3, 3))
    for link, place in links:
        d = place * link.lever - com
        turned = place.rotation @ link.inertia @ place.rotation.T
        inertia += turned + link.mass * (d @ d * np.eye(3) - np.outer(d, d))
    assert mass == pytest.approx(GAINS.body_mass, abs=1e-12)
    assert mass == pytest.approx(TOTAL_MASS, abs=5e-4)
    np.testing.assert_allclose(GAINS.com, com, atol=1e-12)
    np.testing.assert_allclose(GAINS.inertia_inverse @ inertia, np.eye(3), atol=1e-9)


@given(m=size, k=size, n=size, seed=st.integers(0, 2**32 - 1))
@settings(deadline=None)
def test_products(m: int, k: int, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, B, x = rng.normal(size=(m, k)), rng.normal(size=(k, n)), rng.normal(size=k)
    np.testing.assert_allclose(times(A, x), A @ x, atol=1e-12)
    np.testing.assert_allclose(times(B.T, x), B.T @ x, atol=1e-12)
    np.testing.assert_allclose(product(A, B), A @ B, atol=1e-12)
    H = np.zeros((k, k))
    add_gram(2.5, A, H)
    H += np.tril(H, -1).T
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
