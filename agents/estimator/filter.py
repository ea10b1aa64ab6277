"""Kalman filter on IMU and leg kinematics: trunk position, velocity and the four feet.

All noise is isotropic, so the three axes share one 6×6 covariance and every measurement is a
scalar update of it. Absolute position drifts; the controller uses heights over the stance feet.

The IMU has a constant error, of its accelerometer and of the roll and pitch that it gives. Both
accelerate the trunk seemingly, and the legs deny that. What is vertical is the accelerometer's
error. What is horizontal may be either's: gravity shows in a wrong attitude, too. Only in motion
that no walk makes could they be told apart, so it is shared in proportion to the variances that
the two have on real robots.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.estimator.kinematics import cross, leg_kinematics, rotation_matrix
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_IMU_ERROR_MOST: Final = 0.5  # m/s²
_FASTEST: Final = 0.5  # s, time constant of the IMU's error at first
_TILT_SHARE: Final = 0.3  # of an error of 0.01 rad · g beside one of 0.15 m/s², by variance
_ACCEL_SIGMA: Final = 0.3  # m/s², process noise of the velocity
_FOOT_SIGMA: Final = 0.05  # m/s, process noise of a stance foot
_SWING_SIGMA: Final = 30.0  # m/s, process noise of a swing foot
_LEG_POSITION_SIGMA: Final = 1.5e-3  # m, of the leg kinematics
_LEG_VELOCITY_SIGMA: Final = 0.1  # m/s, likewise
_TRUST_RAMP: Final = 0.3  # share of stance over which trust rises, and over which it falls
_TRUST_FORCE: Final = 10.0  # N, a foot with less load is not trusted


@compiled
def take_imu_error_off(state: np.record) -> None:
    """Take the estimated error off `quat_wxyz` and `accel`.

    The attitude becomes q ⊗ (1, −r/2) for its error r: exact to second order, of any norm.
    """
    error = state.imu_error
    w, x, y, z = state.quat_wxyz
    half = 0.5 * _TILT_SHARE / GRAVITY  # an error r of the attitude gives one of g (r × ẑ)
    a, b = half * error[1], -half * error[0]
    quat = np.array([w - x * a - y * b, x + w * a - z * b, y + w * b + z * a, z + x * b - y * a])
    state.quat_wxyz[:] = quat
    for axis in range(3):
        state.accel[axis] -= (1.0 - _TILT_SHARE if axis < 2 else 1.0) * error[axis]


@compiled
def update_imu_error(state: np.record, correction: Array, time_constant: float) -> None:
    """Go on with the estimate: what the legs take back of the velocity is the error that is left.

    Args:
        state: of which `imu_error` and its age change.
        correction: of the trunk's velocity by the legs at this tick, (3,), m/s, odometry frame.
        time_constant: of the estimate, s, once it is that old, before it its age; 0: none is made.
    """
    if time_constant <= 0.0:
        return
    age = min(time_constant, state.imu_error_age + state.dt)
    left = state.R.T @ correction / max(_FASTEST, age)
    state.imu_error_age = age
    for axis in range(3):
        error = state.imu_error[axis] - left[axis]
        state.imu_error[axis] = min(_IMU_ERROR_MOST, max(-_IMU_ERROR_MOST, error))


@compiled
def specific_force_at_origin(accel: Array, omega: Array, imu: Array) -> Array:
    """Specific force at the trunk's origin, a − ω × (ω × r), (3,), m/s², trunk frame.

    The term of the angular acceleration is left out: no sensor measures it, and differences of the
    gyro's samples are noisier than it is large. `imu` is where the accelerometer is, r, (3,), m.
    """
    return accel - cross(omega, cross(omega, imu))


@compiled
def known_covariance() -> Array:
    """Covariance of a state that is known: position, velocity, four feet. (6, 6), m², m²/s²."""
    return np.diag(np.array([1e-6, 1e-4, 1e-5, 1e-5, 1e-5, 1e-5]))


@compiled
def foot_trust(state: np.record) -> Array:
    """Trust (4,) in each foot as an anchor: ramps in and out of stance, zero without load."""
    trust, progress = np.zeros(4), state.progress
    edge = min(1.0, min(progress, 1.0 - progress) / _TRUST_RAMP + 0.02)
    for leg in range(4):
        if state.stance[leg] > 0.5 and state.foot_force[leg] >= _TRUST_FORCE:
            trust[leg] = edge
    return trust


@compiled
def filter_step(state: np.record, gains: np.record, trust: Array) -> Array:
    """Predict with the accelerometer over `dt`, correct with the leg kinematics.

    `trust`, (4,), is that in each foot as an anchor, 0 (swing, unloaded) to 1.

    Returns:
        How the legs corrected the trunk's velocity, (3,), m/s, odometry frame.
    """
    R, mean, covariance = rotation_matrix(state.quat_wxyz), state.filter_mean, state.covariance
    p_leg, v_leg, omega_leg = leg_kinematics(state.q_joint, state.v_joint, gains)
    acceleration = R @ specific_force_at_origin(state.accel, state.omega, gains.imu)
    acceleration[2] -= GRAVITY
    omega = R @ state.omega
    v_roll = np.empty((4, 3))  # of stance feet's centres as their spheres roll, odometry frame
    up = np.array([0.0, 0.0, gains.foot_radius])
    for leg in range(4):
        v_roll[leg] = cross(omega + R @ omega_leg[leg], up)
    _predict(state, acceleration, v_roll, trust)
    expected = mean[1].copy()
    for leg in range(4):
        reach, foot = R @ p_leg[leg], 2 + leg
        gain = covariance[:, foot] - covariance[:, 0]  # the foot's place less the trunk's
        variance = gain[foot] - gain[0] + _LEG_POSITION_SIGMA**2
        _correct(state, gain, variance, reach - (mean[foot] - mean[0]))
        if trust[leg] > 0.0:
            v_trunk = v_roll[leg] - R @ v_leg[leg] - cross(omega, reach)
            gain = covariance[:, 1].copy()
            variance = gain[1] + (_LEG_VELOCITY_SIGMA / trust[leg]) ** 2
            _correct(state, gain, variance, v_trunk - mean[1])
    for leg in range(4):
        state.p_foot[leg] = mean[0] + R @ p_leg[leg]
    covariance[:] = 0.5 * (covariance + covariance.T)
    state.R[:], state.position[:], state.velocity[:] = R, mean[0], mean[1]
    correction: Array = mean[1] - expected
    return correction


@compiled
def _predict(state: np.record, acceleration: Array, v_roll: Array, trust: Array) -> None:
    """Advance mean and covariance by `dt`: the trunk accelerates, stance feet roll."""
    mean, covariance, dt = state.filter_mean, state.covariance, state.dt
    mean[0] += dt * mean[1] + 0.5 * dt * dt * acceleration
    mean[1] += dt * acceleration
    for column in range(6):  # F P Fᵀ with F = I + dt e0 e1ᵀ
        covariance[0, column] += dt * covariance[1, column]
    for row in range(6):
        covariance[row, 0] += dt * covariance[row, 1]
    covariance[1, 1] += (_ACCEL_SIGMA * dt) ** 2
    for leg in range(4):
        if trust[leg] > 0.0:
            mean[2 + leg] += dt * v_roll[leg]
            covariance[2 + leg, 2 + leg] += (_FOOT_SIGMA * dt / trust[leg]) ** 2
        else:
            covariance[2 + leg, 2 + leg] += (_SWING_SIGMA * dt) ** 2


@compiled
def _correct(state: np.record, gain: Array, variance: float, innovation: Array) -> None:
    """Scalar Kalman update of mean and covariance, for all axes alike.

    `gain` is P hᵀ of the measurement's row h, `variance` h P hᵀ plus the measurement's own.
    """
    gain_over_s = gain / variance
    for row in range(6):
        for axis in range(3):
            state.filter_mean[row, axis] += gain_over_s[row] * innovation[axis]
        for column in range(6):
            state.covariance[row, column] -= gain_over_s[row] * gain[column]
