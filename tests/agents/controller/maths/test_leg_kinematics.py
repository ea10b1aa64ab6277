"""Closed-form leg kinematics of every robot against Pinocchio."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.controller.maths.leg_kinematics import leg_kinematics
from quadriga.shared.robots.conventions import FOOT_FRAMES, N_JOINTS, Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.spec import RobotSpec

ANGLES = arrays(np.float64, N_JOINTS, elements=st.floats(-np.pi, np.pi))
RATES = arrays(np.float64, N_JOINTS, elements=st.floats(-20.0, 20.0))


@lru_cache
def model_of(kind: str) -> pin.Model:
    return build_pinocchio_model(ROBOTS[kind])


def by_pinocchio(kind: str, q_joint: Array, v_joint: Array) -> tuple[Array, Array, Array]:
    """Foot positions, velocities and angular velocities with the trunk fixed at the origin."""
    model = model_of(kind)
    data, q = model.createData(), pin.neutral(model)
    q[7:] = q_joint
    pin.forwardKinematics(model, data, q, np.concatenate([np.zeros(6), v_joint]))
    pin.updateFramePlacements(model, data)
    feet = [model.getFrameId(name) for name in FOOT_FRAMES]
    motions = [
        pin.getFrameVelocity(model, data, foot, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        for foot in feet
    ]
    return (
        np.array([data.oMf[foot].translation for foot in feet]),
        np.array([motion.linear for motion in motions]),
        np.array([motion.angular for motion in motions]),
    )


@pytest.mark.parametrize("kind", ROBOTS)
@given(ANGLES, RATES)
@settings(deadline=None, max_examples=60)
def test_positions_and_velocities_are_pinocchios(kind: str, q_joint: Array, v_joint: Array) -> None:
    ours = leg_kinematics(q_joint, v_joint, ROBOTS[kind].geometry)
    for part, theirs in zip(ours, by_pinocchio(kind, q_joint, v_joint), strict=True):
        np.testing.assert_allclose(part, theirs, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS.keys())
def test_the_nominal_pose_puts_every_foot_under_its_hip(robot: RobotSpec) -> None:
    p_foot, _, _ = leg_kinematics(robot.q_stand, np.zeros(N_JOINTS), robot.geometry)
    np.testing.assert_allclose(p_foot[:, :2], robot.feet_under_hips, atol=1e-12)
    height = robot.geometry.foot_radius - robot.stand_height
    np.testing.assert_allclose(p_foot[:, 2], height, atol=1e-12)
