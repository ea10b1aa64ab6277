"""Kalman filter on IMU and leg kinematics: trunk position, velocity and the four feet.

All noise is isotropic, so the three axes share one 6×6 covariance and every measurement is a
scalar update of it. Absolute position drifts; the controller uses heights over the stance feet.
Angular velocity is the IMU's, and so is the attitude, less a constant error of roll and pitch that
is found on the way: with it gravity seems to accelerate the trunk, and the legs deny that.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.foot_load import FootLoad, FootLoadRule
from quadriga.agents.controller.maths.leg_kinematics import leg_kinematics
from quadriga.agents.controller.maths.rotation import cross, rotation_matrix
from quadriga.agents.controller.memory import FilterState
from quadriga.agents.controller.readings import Readings
from quadriga.shared.config.sections import EstimatorConfig
from quadriga.shared.messages import State, Truth
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.robots.spec import Geometry, RobotSpec
from quadriga.shared.runtime.jit import compiled

# Variances of a known state: position, velocity, four feet; m², m²/s², m².
_KNOWN: Final = (1e-6, 1e-4, 1e-5, 1e-5, 1e-5, 1e-5)


class Estimate(NamedTuple):
    """The trunk and the feet as the controller sees them (odometry frame, z up).

    Attributes:
        position: trunk origin, (3,), m.
        velocity: trunk origin, (3,), m/s.
        R: trunk to odometry frame, (3, 3).
        omega: angular velocity, trunk frame, (3,), rad/s.
        p_foot: foot centres, (4, 3), m.
        q_joint: joint angles, (12,), rad.
        v_joint: joint rates, (12,), rad/s.
        foot_load: what each foot bears.
        quat_wxyz: attitude that R belongs to, (4,), of any positive norm.
    """

    position: Array
    velocity: Array
    R: Array
    omega: Array
    p_foot: Array
    q_joint: Array
    v_joint: Array
    foot_load: FootLoad
    quat_wxyz: Array


class FilterNoise(NamedTuple):
    """Standard deviations of the filter.

    Attributes:
        accel: of the accelerometer, m/s².
        foot: drift of a stance foot, m/s.
        swing: drift of a swing foot, m/s.
        leg_position: of a foot's place relative to the trunk, m.
        leg_velocity: of the trunk's velocity by a stance leg, m/s.
    """

    accel: float
    foot: float
    swing: float
    leg_position: float
    leg_velocity: float


class FilterBody(NamedTuple):
    """What the filter knows of the robot.

    Attributes:
        geometry: of the legs.
        imu: where the accelerometer is, (3,), m, trunk frame.
    """

    geometry: Geometry
    imu: Array


N_NOISE: Final = len(FilterNoise._fields)


def filter_noise(config: EstimatorConfig) -> FilterNoise:
    """The standard deviations that a configuration sets."""
    return FilterNoise(
        accel=config.accel_sigma,
        foot=config.foot_sigma,
        swing=config.swing_sigma,
        leg_position=config.leg_position_sigma,
        leg_velocity=config.leg_velocity_sigma,
    )


def known_covariance() -> Array:
    """Covariance of a state that is known, (6, 6), m², m²/s²."""
    return np.diag(_KNOWN)


def standing_filter(state: State, robot: RobotSpec) -> FilterState:
    """Of a robot that stands still at the origin, its feet where the joints say."""
    R = rotation_matrix(state.imu_quat_wxyz)
    p_foot, _, _ = leg_kinematics(state.q_joint, state.v_joint, robot.geometry)
    mean = np.zeros((6, 3))
    mean[0, 2] = robot.stand_height
    mean[2:] = mean[0] + p_foot @ R.T
    return FilterState(mean, known_covariance())


def filter_at(estimate: Estimate) -> FilterState:
    """Of a robot whose estimate is right, to go on from there."""
    mean = np.vstack([estimate.position, estimate.velocity, estimate.p_foot])
    return FilterState(mean, known_covariance())


@compiled
def foot_trust(
    stance: Array, progress: float, foot_load: Array, ramp: float, least_force: float
) -> Array:
    """Trust (4,) in each foot as an anchor: ramps in and out of stance, zero without load."""
    trust = np.zeros(4)
    edge = 1.0 if ramp <= 0.0 else min(1.0, min(progress, 1.0 - progress) / ramp + 0.02)
    for leg in range(4):
        if stance[leg] > 0.5 and foot_load[leg] >= least_force:
            trust[leg] = edge
    return trust


@compiled
def _update(
    mean: Array, covariance: Array, gain: Array, variance: float, innovation: Array
) -> None:
    """Scalar Kalman update in place.

    Args:
        mean: see `FilterState`.
        covariance: likewise.
        gain: P hᵀ of the measurement's row h, (6,).
        variance: h P hᵀ plus the measurement's own.
        innovation: measured less expected, one for each axis, (3,).
    """
    gain_over_s = gain / variance
    for row in range(6):
        for axis in range(3):
            mean[row, axis] += gain_over_s[row] * innovation[axis]
        for column in range(6):
            covariance[row, column] -= gain_over_s[row] * gain[column]


@compiled
def _rolling_velocity(R: Array, omega: Array, omega_leg: Array, foot_radius: float) -> Array:
    """Velocities of stance feet's centres as their spheres roll, (4, 3), m/s, odometry frame."""
    roll_velocity = np.empty((4, 3))
    up = np.array([0.0, 0.0, foot_radius])
    for leg in range(4):
        roll_velocity[leg] = cross(omega + R @ omega_leg[leg], up)
    return roll_velocity


@compiled
def _predict(
    state: FilterState,
    acceleration: Array,
    roll_velocity: Array,
    trust: Array,
    noise: FilterNoise,
    dt: float,
) -> None:
    """Advance mean and covariance by `dt` in place: the trunk accelerates, stance feet roll."""
    mean, covariance = state
    mean[0] += dt * mean[1] + 0.5 * dt * dt * acceleration
    mean[1] += dt * acceleration
    for column in range(6):  # F P Fᵀ with F = I + dt e0 e1ᵀ
        covariance[0, column] += dt * covariance[1, column]
    for row in range(6):
        covariance[row, 0] += dt * covariance[row, 1]
    covariance[1, 1] += (noise.accel * dt) ** 2
    for leg in range(4):
        if trust[leg] > 0.0:
            mean[2 + leg] += dt * roll_velocity[leg]
            covariance[2 + leg, 2 + leg] += (noise.foot * dt / trust[leg]) ** 2
        else:
            covariance[2 + leg, 2 + leg] += (noise.swing * dt) ** 2


@compiled
def specific_force_at_origin(accel: Array, gyro: Array, imu: Array) -> Array:
    """Specific force at the trunk's origin, a − ω × (ω × r), (3,), m/s², trunk frame.

    The term of the angular acceleration is left out: no sensor measures it, and differences of the
    gyro's samples are noisier than it is large.

    Args:
        accel: what the accelerometer measures, (3,), m/s², trunk frame.
        gyro: angular velocity ω, (3,), rad/s, trunk frame.
        imu: where it is, r, (3,), m, trunk frame.
    """
    return accel - cross(gyro, cross(gyro, imu))


@compiled
def filter_step(
    before: FilterState,
    readings: Readings,
    foot_load: FootLoad,
    trust: Array,
    noise: FilterNoise,
    body: FilterBody,
    dt: float,
) -> tuple[FilterState, Estimate, Array]:
    """Predict with the accelerometer over `dt`, correct with the leg kinematics.

    Args:
        before: the filter at the last tick.
        readings: of the sensors.
        foot_load: what each foot bears.
        trust: in each foot as an anchor, (4,), 0 (swing, unloaded) to 1.
        noise: the filter's.
        body: what it knows of the robot.
        dt: time since the last tick, s.

    Returns:
        The filter now, what it estimates, and how the legs corrected the trunk's velocity, (3,),
        m/s, odometry frame.
    """
    R = rotation_matrix(readings.quat_wxyz)
    p_leg, v_leg, omega_leg = leg_kinematics(readings.q_joint, readings.v_joint, body.geometry)
    state = FilterState(before.mean.copy(), before.covariance.copy())
    mean, covariance = state
    acceleration = R @ specific_force_at_origin(readings.accel, readings.gyro, body.imu)
    acceleration[2] -= GRAVITY
    omega = R @ readings.gyro
    roll_velocity = _rolling_velocity(R, omega, omega_leg, body.geometry.foot_radius)
    _predict(state, acceleration, roll_velocity, trust, noise, dt)
    expected = mean[1].copy()
    for leg in range(4):
        reach, foot = R @ p_leg[leg], 2 + leg
        gain = covariance[:, foot] - covariance[:, 0]  # the foot's place less the trunk's
        variance = gain[foot] - gain[0] + noise.leg_position**2
        _update(mean, covariance, gain, variance, reach - (mean[foot] - mean[0]))
        if trust[leg] > 0.0:
            v_trunk = roll_velocity[leg] - R @ v_leg[leg] - cross(omega, reach)
            gain = covariance[:, 1].copy()
            variance = gain[1] + (noise.leg_velocity / trust[leg]) ** 2
            _update(mean, covariance, gain, variance, v_trunk - mean[1])
    p_foot = np.empty((4, 3))
    for leg in range(4):
        p_foot[leg] = mean[0] + R @ p_leg[leg]
    estimate = Estimate(
        mean[0],
        mean[1],
        R,
        readings.gyro,
        p_foot,
        readings.q_joint,
        readings.v_joint,
        foot_load,
        readings.quat_wxyz,
    )
    filtered = FilterState(mean, 0.5 * (covariance + covariance.T))
    return filtered, estimate, mean[1] - expected


def trunk_from_truth(
    truth: Truth, robot: str, state: State, geometry: Geometry, rule: FootLoadRule
) -> Estimate:
    """The estimate the simulator's truth gives, for comparison with the filter's.

    Args:
        truth: of a world in which the robot is.
        robot: its name.
        state: what it measures.
        geometry: of its legs.
        rule: how loads are told: by foot sensors that measure N, or by the truth too.
    """
    index = truth.robots.index(robot)
    R = rotation_matrix(truth.base_quat_wxyz[index])
    position, velocity = truth.base_pos[index], truth.base_vel[index]
    p_leg, _, _ = leg_kinematics(state.q_joint, state.v_joint, geometry)
    force = state.foot_force if rule.fused < 0.5 else truth.grf[index, :, 2]
    # Copies can be written to, as what the filter gives: machine code is made for each type.
    return Estimate(
        position.copy(),
        velocity.copy(),
        R,
        R.T @ truth.base_omega[index],
        position + p_leg @ R.T,
        state.q_joint.copy(),
        state.v_joint.copy(),
        FootLoad(force.copy(), force >= rule.least_force),
        truth.base_quat_wxyz[index].copy(),
    )
