"""Rotations against their group laws, rotations and legs against Pinocchio."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.estimator.kinematics import (
    cross,
    heading,
    leg_kinematics,
    roll_pitch_yaw,
    rotation_matrix,
    wrap_angle,
)
from quadriga.shared.robots.conventions import FOOT_FRAMES, N_JOINTS, Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.spec import RobotSpec

QUATERNIONS = arrays(np.float64, 4, elements=st.floats(-1.0, 1.0)).filter(
    lambda quat: bool(np.linalg.norm(quat) > 0.1)
)
VECTORS = arrays(np.float64, 3, elements=st.floats(-10.0, 10.0))
ANGLES = arrays(np.float64, N_JOINTS, elements=st.floats(-np.pi, np.pi))
RATES = arrays(np.float64, N_JOINTS, elements=st.floats(-20.0, 20.0))
fast = settings(deadline=None, max_examples=50)


def product(p: Array, q: Array) -> Array:
    """Hamilton product of two quaternions, wxyz."""
    return np.concatenate(
        [[p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]
    )


@given(QUATERNIONS, QUATERNIONS, st.floats(0.01, 100.0))
@fast
def test_matrices_multiply_as_quaternions_of_any_norm_do(p: Array, q: Array, scale: float) -> None:
    R = rotation_matrix(p)
    np.testing.assert_allclose(
        rotation_matrix(scale * product(p, q)), R @ rotation_matrix(q), atol=1e-12
    )
    w, x, y, z = p / np.linalg.norm(p)
    np.testing.assert_allclose(R, pin.Quaternion(w, x, y, z).matrix(), atol=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
@fast
def test_roll_pitch_yaw_undoes_the_three_turns(roll: float, pitch: float, yaw: float) -> None:
    R = pin.utils.rotate("z", yaw) @ pin.utils.rotate("y", pitch) @ pin.utils.rotate("x", roll)
    np.testing.assert_allclose(roll_pitch_yaw(R), [roll, pitch, yaw], atol=1e-9)
    np.testing.assert_allclose(heading(R), [np.cos(yaw), np.sin(yaw)], atol=1e-9)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_trunk_that_points_straight_up_or_down_has_a_heading_and_a_pitch(sign: float) -> None:
    R = rotation_matrix(np.array([0.5, -0.5 * sign, 0.5 * sign, 0.5]))
    assert R[0, 0] == R[1, 0] == 0.0
    assert heading(R) == (1.0, 0.0)
    R = pin.utils.rotate("y", np.pi / 2)
    R[2, 0] = -1.0 - 1e-12  # by rounding
    assert abs(roll_pitch_yaw(R)[1] - np.pi / 2) < 1e-5


@given(VECTORS, VECTORS, st.floats(-100.0, 100.0))
@fast
def test_cross_is_the_vector_product_and_wrapping_leaves_whole_turns(
    a: Array, b: Array, angle: float
) -> None:
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-12)
    assume(abs(abs(angle) % (2 * np.pi) - np.pi) > 1e-9)
    turns = (angle - wrap_angle(angle)) / (2 * np.pi)
    assert abs(wrap_angle(angle)) <= np.pi
    assert abs(turns - round(turns)) < 1e-9


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
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    motions = [pin.getFrameVelocity(model, data, foot, world) for foot in feet]
    return (
        np.array([data.oMf[foot].translation for foot in feet]),
        np.array([motion.linear for motion in motions]),
        np.array([motion.angular for motion in motions]),
    )


@pytest.mark.parametrize("kind", ROBOTS)
@given(ANGLES, RATES)
@fast
def test_positions_and_velocities_of_feet_are_pinocchios(
    kind: str, q_joint: Array, v_joint: Array
) -> None:
    ours = leg_kinematics(q_joint, v_joint, ROBOTS[kind].geometry)
    for part, theirs in zip(ours, by_pinocchio(kind, q_joint, v_joint), strict=True):
        np.testing.assert_allclose(part, theirs, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS.keys())
def test_the_nominal_pose_puts_every_foot_under_its_hip(robot: RobotSpec) -> None:
    p_foot, _, _ = leg_kinematics(robot.q_stand, np.zeros(N_JOINTS), robot.geometry)
    np.testing.assert_allclose(p_foot[:, :2], robot.feet_under_hips, atol=1e-12)
    height = robot.geometry.foot_radius - robot.stand_height
    np.testing.assert_allclose(p_foot[:, 2], height, atol=1e-12)
