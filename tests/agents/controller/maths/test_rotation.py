"""Group laws of the rotations, and Pinocchio's word on their conventions."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.controller.maths.rotation import (
    cross,
    heading,
    roll_pitch_yaw,
    rotation_matrix,
    wrap_angle,
)
from quadriga.shared.robots.conventions import Array

QUATERNIONS = arrays(np.float64, 4, elements=st.floats(-1.0, 1.0)).filter(
    lambda quat: bool(np.linalg.norm(quat) > 0.1)
)
VECTORS = arrays(np.float64, 3, elements=st.floats(-10.0, 10.0))
fast = settings(deadline=None, max_examples=50)


def product(p: Array, q: Array) -> Array:
    """Hamilton product of two quaternions, wxyz."""
    return np.concatenate(
        [[p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]
    )


@given(QUATERNIONS, QUATERNIONS)
@fast
def test_matrices_multiply_as_quaternions_do(p: Array, q: Array) -> None:
    expected = rotation_matrix(p) @ rotation_matrix(q)
    np.testing.assert_allclose(rotation_matrix(product(p, q)), expected, atol=1e-12)


@given(QUATERNIONS, st.floats(0.01, 100.0))
@fast
def test_a_quaternion_of_any_norm_is_a_proper_rotation(quat: Array, scale: float) -> None:
    R = rotation_matrix(scale * quat)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) > 0.0
    w, x, y, z = quat / np.linalg.norm(quat)
    np.testing.assert_allclose(R, pin.Quaternion(w, x, y, z).matrix(), atol=1e-12)


@given(QUATERNIONS)
@fast
def test_the_conjugate_turns_back(quat: Array) -> None:
    back = rotation_matrix(quat * [1.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(back, rotation_matrix(quat).T, atol=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
@fast
def test_roll_pitch_yaw_undoes_the_three_turns(roll: float, pitch: float, yaw: float) -> None:
    R = pin.utils.rotate("z", yaw) @ pin.utils.rotate("y", pitch) @ pin.utils.rotate("x", roll)
    np.testing.assert_allclose(roll_pitch_yaw(R), [roll, pitch, yaw], atol=1e-9)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_trunk_that_points_straight_up_or_down_has_a_heading(sign: float) -> None:
    R = rotation_matrix(np.array([0.5, -0.5 * sign, 0.5 * sign, 0.5]))
    assert R[0, 0] == R[1, 0] == 0.0
    assert heading(R) == (1.0, 0.0)


def test_pitch_stays_a_number_where_rounding_leaves_the_sine_beyond_one() -> None:
    R = pin.utils.rotate("y", np.pi / 2)
    R[2, 0] = -1.0 - 1e-12
    assert abs(roll_pitch_yaw(R)[1] - np.pi / 2) < 1e-5


@given(VECTORS, VECTORS)
@fast
def test_cross_is_the_vector_product(a: Array, b: Array) -> None:
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-12)


@given(st.floats(-100.0, 100.0))
@fast
def test_wrapping_changes_an_angle_by_whole_turns_only(angle: float) -> None:
    assume(abs(abs(angle) % (2 * np.pi) - np.pi) > 1e-9)
    wrapped = wrap_angle(angle)
    turns = (angle - wrapped) / (2 * np.pi)
    assert abs(wrapped) <= np.pi
    assert abs(turns - round(turns)) < 1e-9
