"""The error of an IMU, against Pinocchio's rotations and gravity itself."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.controller.imu_error import update_imu_error, without_imu_error
from quadriga.agents.controller.readings import Readings
from quadriga.shared.robots.conventions import GRAVITY, Array

DT = 1e-3
UP = np.array([0.0, 0.0, GRAVITY])
TILT_SHARE = 0.3


def rotation(rng: np.random.Generator) -> Array:
    """A trunk near level, at any heading."""
    roll, pitch = rng.uniform(-0.2, 0.2, 2)
    return np.array(pin.rpy.rpyToMatrix(roll, pitch, rng.uniform(-np.pi, np.pi)))


def believed(R: Array, accel: Array, error: Array) -> tuple[Array, Array]:
    """Attitude and specific force of an IMU that gives R and `accel`, without its error."""
    x, y, z, w = pin.Quaternion(R).coeffs()
    legs, feet = np.zeros(12), np.zeros(4)
    read = Readings(legs, legs, legs, np.array([w, x, y, z]), np.zeros(3), accel, feet)
    left = without_imu_error(read, error)
    w, x, y, z = left.quat_wxyz
    return pin.Quaternion(w, x, y, z).normalized().toRotationMatrix(), left.accel


@given(st.integers(0, 10_000), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_taking_a_tilt_off_undoes_it(seed: int, roll: float, pitch: float) -> None:
    R = rotation(np.random.default_rng(seed))
    error = GRAVITY / TILT_SHARE * np.array([pitch, -roll, 0.0])
    found, _ = believed(R @ pin.exp3(np.array([roll, pitch, 0.0])), UP, error)
    np.testing.assert_allclose(found, R, atol=2e-4)


@pytest.mark.parametrize("seed", range(4))
def test_an_error_is_found_from_what_the_legs_deny(seed: int) -> None:
    """What seems to accelerate a trunk at rest is taken back by its legs, in all three axes."""
    rng = np.random.default_rng(seed)
    tilt, bias = 0.01 * rng.standard_normal(2), 0.15 * rng.standard_normal(3)
    R, memory = rotation(rng), np.zeros(4)
    measured, accel = R @ pin.exp3(np.array([*tilt, 0.0])), R.T @ UP + bias
    for _ in range(4000):
        told, force = believed(measured, accel, memory[:3])
        seeming = told @ force - UP
        update_imu_error(memory, -DT * seeming, told, 5.0, DT)
    np.testing.assert_allclose(seeming, 0.0, atol=0.02)


def test_of_a_horizontal_error_the_attitude_takes_its_share() -> None:
    """An accelerometer's error of 0.15 m/s² tilts the trunk by 0.3 · 0.15 / g, and no more."""
    error = np.array([0.15, 0.0, 0.1])
    told, force = believed(np.eye(3), UP + error, error)
    assert pin.rpy.matrixToRpy(told)[1] == pytest.approx(-TILT_SHARE * 0.15 / GRAVITY, rel=1e-3)
    np.testing.assert_allclose(told @ force, UP, atol=2e-3)


def test_without_a_time_constant_no_error_is_assumed() -> None:
    memory = np.zeros(4)
    update_imu_error(memory, np.ones(3), np.eye(3), 0.0, DT)
    np.testing.assert_array_equal(memory, np.zeros(4))


def test_an_estimate_stays_small_whatever_happens() -> None:
    memory = np.zeros(4)
    for _ in range(100):
        update_imu_error(memory, np.array([10.0, -10.0, 10.0]), np.eye(3), 1.0, DT)
    np.testing.assert_allclose(memory[:3], [-0.5, 0.5, -0.5])
