"""Kalman filter on IMU and leg kinematics: trunk position, velocity and the four feet.

All noise is isotropic, so the three axes share one 6×6 covariance and every measurement is a
scalar update of it. Absolute position drifts; the controller uses heights over the stance feet.
Attitude and angular velocity are the IMU's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quadriga.agents.controller.maths.leg_kinematics import leg_kinematics
from quadriga.agents.controller.maths.rotation import cross, rotation_matrix
from quadriga.shared.config.sections import EstimatorConfig
from quadriga.shared.robot.a1 import FOOT_RADIUS, GRAVITY, STAND_HEIGHT, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.messages import State, Truth

_SURE = (1e-6, 1e-4, 1e-5, 1e-5, 1e-5, 1e-5)  # variances of a state that is known, m², m²/s²


@dataclass(frozen=True, slots=True)
class Estimate:
    """The trunk and the feet as the controller sees them (odometry frame, z up).

    Attributes:
        position: trunk origin, (3,), m.
        velocity: trunk origin, (3,), m/s.
        R: trunk to odometry frame, (3, 3).
        omega: angular velocity, trunk frame, (3,), rad/s.
        p_foot: foot centres, (4, 3), m.
        q_joint: joint angles, (12,), rad.
        v_joint: joint rates, (12,), rad/s.
        foot_force: measured normal forces, (4,), N.
    """

    position: Array
    velocity: Array
    R: Array
    omega: Array
    p_foot: Array
    q_joint: Array
    v_joint: Array
    foot_force: Array


def noise_parameters(config: EstimatorConfig) -> Array:
    """The filter's standard deviations as the compiled step takes them. Shape (5,)."""
    return np.array(
        [
            config.accel_sigma,
            config.foot_sigma,
            config.swing_sigma,
            config.leg_position_sigma,
            config.leg_velocity_sigma,
        ]
    )


def standing_mean(state: State) -> Array:
    """Mean of a robot that stands still at the origin, feet where the joints say. (6, 3)."""
    R = rotation_matrix(state.imu_quat_wxyz)
    p_foot, _, _ = leg_kinematics(state.q_joint, state.v_joint)
    mean = np.zeros((6, 3))
    mean[0, 2] = STAND_HEIGHT
    mean[2:] = mean[0] + p_foot @ R.T
    return mean


def mean_at(estimate: Estimate) -> Array:
    """The mean of a filter that takes an estimate for right, to go on from it. (6, 3)."""
    return np.vstack([estimate.position, estimate.velocity, estimate.p_foot])


def sure() -> Array:
    """Covariance of a state that is known, (6, 6), m², m²/s²."""
    return np.diag(_SURE)


@compiled
def foot_trust(
    stance: Array, progress: float, foot_force: Array, ramp: float, least_force: float
) -> Array:
    """Trust (4,) in each foot as an anchor: ramps in and out of stance, zero without load."""
    trust = np.zeros(4)
    edge = 1.0 if ramp <= 0.0 else min(1.0, min(progress, 1.0 - progress) / ramp + 0.02)
    for leg in range(4):
        if stance[leg] > 0.5 and foot_force[leg] >= least_force:
            trust[leg] = edge
    return trust


@compiled
def _update(mean: Array, covariance: Array, h: Array, innovation: Array, variance: float) -> None:
    """Scalar Kalman update in place: measurement row h (6,), one innovation per axis (3,)."""
    gain = covariance @ h
    gain_over_s = gain / (np.sum(h * gain) + variance)
    for row in range(6):
        for axis in range(3):
            mean[row, axis] += gain_over_s[row] * innovation[axis]
        for column in range(6):
            covariance[row, column] -= gain_over_s[row] * gain[column]


@compiled
def filter_step(
    mean0: Array,
    covariance0: Array,
    quat: Array,
    gyro: Array,
    accel: Array,
    q_joint: Array,
    v_joint: Array,
    trust: Array,
    noise: Array,
    dt: float,
) -> tuple[Array, Array, Array]:
    """Predict with the accelerometer over `dt`, correct with the leg kinematics.

    Rows of the mean (6, 3) are trunk position, trunk velocity, feet FL FR RL RR; the covariance
    (6, 6) is the same for all axes. `quat` (wxyz) to `v_joint` are of `State`; `trust` (4,) is that
    in each foot as an anchor, 0 (swing, unloaded) to 1; `noise` is `noise_parameters`; `dt` in s is
    since the last tick.

    Returns:
        The new mean and covariance; the trunk's R, (3, 3), over the feet's places, (4, 3).
    """
    R = rotation_matrix(quat)
    p_leg, v_leg, omega_leg = leg_kinematics(q_joint, v_joint)
    mean, covariance = mean0.copy(), covariance0.copy()
    acceleration = R @ accel
    acceleration[2] -= GRAVITY
    omega = R @ gyro
    roll_velocity = np.empty((4, 3))  # the foot's centre moves as the sphere rolls
    up = np.array([0.0, 0.0, FOOT_RADIUS])
    for leg in range(4):
        roll_velocity[leg] = cross(omega + R @ omega_leg[leg], up)

    mean[0] += dt * mean[1] + 0.5 * dt * dt * acceleration
    mean[1] += dt * acceleration
    for column in range(6):  # F P Fᵀ with F = I + dt e0 e1ᵀ
        covariance[0, column] += dt * covariance[1, column]
    for row in range(6):
        covariance[row, 0] += dt * covariance[row, 1]
    covariance[1, 1] += (noise[0] * dt) ** 2
    for leg in range(4):
        if trust[leg] > 0.0:
            mean[2 + leg] += dt * roll_velocity[leg]
            covariance[2 + leg, 2 + leg] += (noise[1] * dt / trust[leg]) ** 2
        else:
            covariance[2 + leg, 2 + leg] += (noise[2] * dt) ** 2

    h = np.zeros(6)
    frame = np.empty((7, 3))
    frame[:3] = R
    for leg in range(4):
        reach = R @ p_leg[leg]
        h[:] = 0.0
        h[0], h[2 + leg] = -1.0, 1.0
        _update(mean, covariance, h, reach - (mean[2 + leg] - mean[0]), noise[3] ** 2)
        if trust[leg] > 0.0:
            h[:] = 0.0
            h[1] = 1.0
            v_trunk = roll_velocity[leg] - R @ v_leg[leg] - cross(omega, reach)
            _update(mean, covariance, h, v_trunk - mean[1], (noise[4] / trust[leg]) ** 2)
    for leg in range(4):
        frame[3 + leg] = mean[0] + R @ p_leg[leg]
    return mean, 0.5 * (covariance + covariance.T), frame


def trunk_from_truth(truth: Truth, robot: str, state: State) -> Estimate:
    """The estimate the simulator's truth gives, for comparison with the filter's.

    Args:
        truth: of a world in which the robot is.
        robot: its name.
        state: what it measures.
    """
    index = truth.robots.index(robot)
    R = rotation_matrix(truth.base_quat_wxyz[index])
    position, velocity = truth.base_pos[index], truth.base_vel[index]
    p_leg, _, _ = leg_kinematics(state.q_joint, state.v_joint)
    return Estimate(
        position.copy(),
        velocity.copy(),
        R,
        R.T @ truth.base_omega[index],
        position + p_leg @ R.T,
        state.q_joint,
        state.v_joint,
        state.foot_force,
    )
