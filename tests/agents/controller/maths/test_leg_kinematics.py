"""Closed-form leg kinematics against Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.controller.maths.leg_kinematics import hip_neutral, leg_kinematics
from quadriga.shared.robot.a1 import FOOT_RADIUS, STAND_HEIGHT, q_stand
from quadriga.shared.robot.conventions import N_JOINTS, Array
from tests.agents.controller.poses import FEET, MODEL

ANGLES = arrays(np.float64, N_JOINTS, elements=st.floats(-np.pi, np.pi))
RATES = arrays(np.float64, N_JOINTS, elements=st.floats(-20.0, 20.0))


def by_pinocchio(q_joint: Array, v_joint: Array) -> tuple[Array, Array, Array]:
    """Foot positions, velocities and angular velocities with the trunk fixed at the origin."""
    data, q = MODEL.createData(), pin.neutral(MODEL)
    q[7:] = q_joint
    pin.forwardKinematics(MODEL, data, q, np.concatenate([np.zeros(6), v_joint]))
    pin.updateFramePlacements(MODEL, data)
    motions = [
        pin.getFrameVelocity(MODEL, data, foot, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        for foot in FEET
    ]
    return (
        np.array([data.oMf[foot].translation for foot in FEET]),
        np.array([motion.linear for motion in motions]),
        np.array([motion.angular for motion in motions]),
    )


@given(ANGLES, RATES)
@settings(deadline=None, max_examples=60)
def test_positions_and_velocities_are_pinocchios(q_joint: Array, v_joint: Array) -> None:
    for ours, theirs in zip(
        leg_kinematics(q_joint, v_joint), by_pinocchio(q_joint, v_joint), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12)


def test_the_nominal_pose_puts_every_foot_under_its_neutral_point() -> None:
    p_foot, _, _ = leg_kinematics(q_stand(), np.zeros(N_JOINTS))
    np.testing.assert_allclose(p_foot[:, :2], hip_neutral(), atol=1e-12)
    np.testing.assert_allclose(p_foot[:, 2], FOOT_RADIUS - STAND_HEIGHT, atol=1e-12)
