"""The ground's forces by the torques of the legs, and the body, against Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.estimator.leg_dynamics import foot_forces, link_table, reaction_torques
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import GEOMETRY, TOTAL_MASS, q_stand
from tests.agents.estimator.poses import BODY, FEET, MODEL, random_pose


def contact_torques(q: Array, v: Array, a: Array, force: Array) -> Array:
    """Joint torques, (12,), of a motion while the ground presses on the feet, trunk frame."""
    data = MODEL.createData()
    R = pin.Quaternion(q[3:7]).matrix()
    tau = pin.rnea(MODEL, data, q, v, a)
    pin.computeJointJacobians(MODEL, data, q)
    pin.updateFramePlacements(MODEL, data)
    for frame, f in zip(FEET, force, strict=True):
        J = pin.getFrameJacobian(MODEL, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
        tau = tau - J.T @ (R @ f)
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
    static, inertial = reaction_torques(pose, a[6:], specific_force, BODY.links)
    found = foot_forces(static + inertial, pose.q_joint, GEOMETRY)
    np.testing.assert_allclose(found, force, atol=1e-6)


def test_a_stretched_leg_tells_no_force_and_no_leg_tells_of_another() -> None:
    q = q_stand()
    q[1:3] = 0.0
    found = np.abs(foot_forces(np.ones(12), q, GEOMETRY))
    np.testing.assert_array_equal(found[0], np.zeros(3))
    assert found[1:].min() > 0.0
    for leg in range(4):
        torques = np.zeros(12)
        torques[3 * leg : 3 * leg + 3] = 1.0
        found = np.abs(foot_forces(torques, q_stand(), GEOMETRY)).sum(axis=1)
        np.testing.assert_array_equal(found > 0.0, np.arange(4) == leg)


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
