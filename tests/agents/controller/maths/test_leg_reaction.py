"""The ground's forces by the torques of the legs, against Pinocchio's equation of motion."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.maths.leg_reaction import LegMotion, foot_forces, reaction_torques
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import GEOMETRY
from tests.agents.controller.poses import BODY, FEET, MODEL, random_pose, standing_pose


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
    specific_force = linear + pose.estimate.R.T @ np.array([0.0, 0.0, GRAVITY])
    tau = contact_torques(pose.q, pose.v, a, force)
    motion = LegMotion(pose.q[7:], pose.v[6:], tau, pose.v[3:6], specific_force)
    static, inertial = reaction_torques(motion, a[6:], BODY.links)
    found = foot_forces(static + inertial, pose.q[7:], GEOMETRY)
    np.testing.assert_allclose(found, force, atol=1e-6)


def test_a_stretched_leg_tells_no_force() -> None:
    q = standing_pose().q[7:].copy()
    q[1:3] = 0.0
    found = foot_forces(np.ones(12), q, GEOMETRY)
    np.testing.assert_array_equal(found[0], np.zeros(3))
    assert np.abs(found[1:]).min() > 0.0


@pytest.mark.parametrize("leg", range(4))
def test_torques_of_a_leg_tell_of_its_own_foot_alone(leg: int) -> None:
    torques = np.zeros(12)
    torques[3 * leg : 3 * leg + 3] = 1.0
    found = np.abs(foot_forces(torques, standing_pose().q[7:], GEOMETRY)).sum(axis=1)
    np.testing.assert_array_equal(found > 0.0, np.arange(4) == leg)
