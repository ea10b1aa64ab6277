"""Rigid-body terms against Pinocchio's other algorithms and against sums by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from quadriga.agents.controller.maths.links import link_table
from quadriga.agents.controller.model import RigidBody
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots import pinocchio_model
from quadriga.shared.robots.a1 import A1
from tests.a1 import TOTAL_MASS, q_stand
from tests.agents.controller.poses import BODY, FEET, MODEL, random_pose


@pytest.mark.parametrize("seed", range(5))
def test_terms_are_those_of_the_equation_of_motion(seed: int) -> None:
    pose = random_pose(np.random.default_rng(seed), tilt=1.0)
    terms, data = pose.terms(), MODEL.createData()
    M = pin.crba(MODEL, data, pose.q)
    M = np.triu(M) + np.triu(M, 1).T
    np.testing.assert_allclose(terms.M_inverse @ M, np.eye(18), atol=1e-9)
    np.testing.assert_allclose(
        terms.nle, pin.rnea(MODEL, data, pose.q, pose.v, np.zeros(18)), atol=1e-10
    )
    np.testing.assert_allclose(terms.v, pose.v, atol=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_jacobians_give_the_velocities_of_the_feet(seed: int) -> None:
    """A joint's column is the spatial velocity it gives to all that it carries."""
    pose = random_pose(np.random.default_rng(seed))
    J, data = pose.terms().J, MODEL.createData()
    for leg, foot in enumerate(FEET):
        columns = [*range(6), *range(6 + 3 * leg, 9 + 3 * leg)]
        twist = J[:, columns] @ pose.v[columns]
        velocity = twist[:3] + np.cross(twist[3:], pose.estimate.p_foot[leg])
        pin.forwardKinematics(MODEL, data, pose.q, pose.v)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        expected = pin.getFrameVelocity(MODEL, data, foot, world)
        np.testing.assert_allclose(velocity, expected.linear, atol=1e-12)


def test_the_derivative_of_the_jacobians_is_their_difference_in_time() -> None:
    pose, dt = random_pose(np.random.default_rng(7)), 1e-6
    data = MODEL.createData()
    before, after = (
        pin.computeJointJacobians(MODEL, data, pin.integrate(MODEL, pose.q, h * pose.v)).copy()
        for h in (-dt, dt)
    )
    np.testing.assert_allclose(pose.terms().dJ, (after - before) / (2 * dt), atol=1e-6)


def test_an_attitude_need_not_be_of_unit_norm() -> None:
    pose = random_pose(np.random.default_rng(1))
    q = pose.q.copy()
    q[3:7] *= 1.01
    np.testing.assert_allclose(replace(pose, q=q).terms().nle, pose.terms().nle, atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_rotors_are_felt_by_their_own_joints_alone(seed: int) -> None:
    pose = random_pose(np.random.default_rng(seed), tilt=1.0)
    model = pinocchio_model.build_pinocchio_model(A1, rotors=True)
    terms = RigidBody(A1, rotors=True).terms(pose.q, pose.v, 3.0)
    bare = BODY.terms(pose.q, pose.v, 3.0)
    M, without = np.linalg.inv(terms.M_inverse), np.linalg.inv(bare.M_inverse)
    np.testing.assert_allclose(M - without, np.diag([*[0.0] * 6, *A1.rotor_inertias]), atol=1e-9)
    np.testing.assert_array_equal(terms.nle, bare.nle)
    assert link_table(model)[1:, -1].tolist() == A1.rotor_inertias.tolist()


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
    assert mass == pytest.approx(BODY.mass, abs=1e-12)
    assert mass == pytest.approx(TOTAL_MASS, abs=5e-4)
    np.testing.assert_allclose(BODY.com, com, atol=1e-12)
    np.testing.assert_allclose(BODY.inertia_inverse @ inertia, np.eye(3), atol=1e-9)
