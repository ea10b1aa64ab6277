"""The error of an IMU's roll and pitch, against Pinocchio's rotations and gravity itself."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.controller.tilt_error import update_tilt_error, without_tilt_error
from quadriga.shared.robot.conventions import GRAVITY, Array

DT = 1e-3


def rotation(rng: np.random.Generator) -> Array:
    """A trunk near level, at any heading."""
    roll, pitch = rng.uniform(-0.2, 0.2, 2)
    return np.array(pin.rpy.rpyToMatrix(roll, pitch, rng.uniform(-np.pi, np.pi)))


def quat_of(R: Array) -> Array:
    x, y, z, w = pin.Quaternion(R).coeffs()
    return np.array([w, x, y, z])


@given(st.integers(0, 10_000), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_taking_an_error_off_undoes_it(seed: int, roll: float, pitch: float) -> None:
    R, error = rotation(np.random.default_rng(seed)), np.array([roll, pitch])
    measured = R @ pin.exp3(np.array([roll, pitch, 0.0]))
    w, x, y, z = without_tilt_error(quat_of(measured), error)
    found = pin.Quaternion(w, x, y, z).normalized().toRotationMatrix()
    np.testing.assert_allclose(found, R, atol=2e-4)


@pytest.mark.parametrize("seed", range(4))
def test_an_error_is_found_from_what_the_legs_deny(seed: int) -> None:
    """Gravity seen with a wrong attitude accelerates a trunk at rest; legs take all of it back."""
    rng = np.random.default_rng(seed)
    error, memory, R = rng.uniform(-0.03, 0.03, 2), np.zeros(3), rotation(rng)
    specific_force = R.T @ np.array([0.0, 0.0, GRAVITY])
    measured = quat_of(R @ pin.exp3(np.array([*error, 0.0])))
    for _ in range(4000):
        w, x, y, z = without_tilt_error(measured, memory[:2])
        believed = pin.Quaternion(w, x, y, z).normalized().toRotationMatrix()
        seeming = believed @ specific_force - np.array([0.0, 0.0, GRAVITY])
        update_tilt_error(memory, -DT * seeming, believed, 5.0, DT)
    np.testing.assert_allclose(memory[:2], error, atol=3e-3)


def test_without_a_time_constant_no_error_is_assumed() -> None:
    memory = np.zeros(3)
    update_tilt_error(memory, np.ones(3), np.eye(3), 0.0, DT)
    np.testing.assert_array_equal(memory, np.zeros(3))


def test_an_estimate_stays_small_whatever_happens() -> None:
    memory = np.zeros(3)
    for _ in range(100):
        update_tilt_error(memory, np.array([10.0, -10.0, 0.0]), np.eye(3), 1.0, DT)
    np.testing.assert_allclose(memory[:2], [-0.05, -0.05])
