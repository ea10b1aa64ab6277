"""`estimate`: from what a robot senses to where it is, on which feet it stands and what it carries.

In a tick: readings without the IMU's error, what feet bear, the filter, the IMU's error, outputs,
contacts, load.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.estimator.contact import update_contacts
from quadriga.agents.estimator.filter import (
    filter_step,
    foot_trust,
    known_covariance,
    take_imu_error_off,
    update_imu_error,
)
from quadriga.agents.estimator.foot_load import forget_foot_load, update_foot_load
from quadriga.agents.estimator.kinematics import leg_kinematics, roll_pitch_yaw, rotation_matrix
from quadriga.agents.estimator.payload_friction import update_payload
from quadriga.agents.estimator.robot_state import GAINS, ROBOT_STATE, RobotState
from quadriga.shared.messages import State, Truth
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_SENSED: Final = slice(RobotState.CUTS["q_joint"][0].start, RobotState.CUTS["foot_counts"][0].stop)
NO_TRUTH: Final = np.empty(0)  # for the truth that is not known


def estimate(
    before: RobotState | None,
    sensors: State,
    schedule: Array,
    dt: float,
    gains: Array,
    truth: Array | None = None,
) -> RobotState:
    """A robot's state at a tick, `dt` s after the last one.

    `before` is the state after `control` then; None: the robot stands still at the origin.
    `schedule` is a row of `Gait`, `gains` a `gains_row`, `truth` a `truth_row` to take for the
    filter's estimate, for comparison with it.
    """
    row = np.empty(ROBOT_STATE.itemsize // 8)
    row0 = standing_state(sensors, gains).row if before is None else before.row
    estimate_rows(row0, row, sensors.row, schedule, dt, gains, NO_TRUTH if truth is None else truth)
    if before is None:  # feet are anchored where they are, the heading is kept
        state = row.view(ROBOT_STATE)[0]
        state.swing_start = state.foot_goal = state.p_foot
        state.yaw_des = roll_pitch_yaw(state.R)[2]
    return RobotState(row)


def standing_state(sensors: State, gains: Array) -> RobotState:
    """Before the first tick: a robot on flat ground at height zero, its feet where joints say."""
    row, robot = np.zeros(ROBOT_STATE.itemsize // 8), gains.view(GAINS)[0]
    state = row.view(ROBOT_STATE)[0]
    state.contact = state.touchdown_seen = 1.0
    state.half_cycle = -1.0
    R = rotation_matrix(sensors.imu_quat_wxyz)
    p_foot, _, _ = leg_kinematics(sensors.q_joint, sensors.v_joint, robot)
    state.filter_mean[0, 2] = robot.stand_height
    state.filter_mean[2:] = state.filter_mean[0] + p_foot @ R.T
    state.covariance = known_covariance()
    return RobotState(row)


def truth_row(truth: Truth, robot: str) -> Array:
    """The simulator's attitude, place, velocity, rate and loads of feet of a robot, (17,)."""
    i = truth.robots.index(robot)
    trunk = truth.base_quat_wxyz[i], truth.base_pos[i], truth.base_vel[i], truth.base_omega[i]
    return np.concatenate([*trunk, truth.grf[i, :, 2]])


@compiled
def estimate_rows(
    before: Array,
    after: Array,
    readings: Array,
    schedule: Array,
    dt: float,
    gains_row: Array,
    truth: Array,
) -> None:
    """Fill the row `after` from the row `before`, `State.row`, a row of `Gait` and `truth_row`."""
    after[:] = before
    state, gains = after.view(ROBOT_STATE)[0], gains_row.view(GAINS)[0]
    state.dt = dt
    state.stance[:], state.progress = schedule[:4], schedule[4]
    state.switched = 1.0 if schedule[5] != state.half_cycle else 0.0
    state.half_cycle = schedule[5]
    after[_SENSED] = readings
    if len(truth) > 0:
        _take_truth(state, gains, truth)
    else:
        take_imu_error_off(state)
        update_foot_load(state, gains)
        correction = filter_step(state, gains, foot_trust(state))
        update_imu_error(state, correction, gains.tilt_time)

    R, quat = state.R, state.quat_wxyz
    norm = np.sqrt(np.sum(quat * quat))
    state.q[:3], state.q[3:6], state.q[6] = state.position, quat[1:] / norm, quat[0] / norm
    state.q[7:], state.v[6:] = state.q_joint, state.v_joint
    state.v[:3], state.v[3:6] = R.T @ state.velocity, state.omega
    state.outputs[:] = outputs_at(state)
    update_contacts(state, gains)
    update_payload(state, gains)


@compiled
def _take_truth(state: np.record, gains: np.record, truth: Array) -> None:
    """Have a robot know where it is and what its feet bear; the filter goes on from there."""
    state.quat_wxyz[:], state.position[:], state.velocity[:] = truth[:4], truth[4:7], truth[7:10]
    R = rotation_matrix(state.quat_wxyz)
    state.R[:], state.omega[:] = R, R.T @ truth[10:13]
    p_leg, _, _ = leg_kinematics(state.q_joint, state.v_joint, gains)
    for leg in range(4):
        state.p_foot[leg] = state.position + R @ p_leg[leg]
    state.filter_mean[0], state.filter_mean[1] = state.position, state.velocity
    state.filter_mean[2:], state.covariance[:] = state.p_foot, known_covariance()
    forget_foot_load(state)
    state.foot_force[:] = truth[13:]
    for leg in range(4):
        state.foot_loaded[leg] = 1.0 if truth[13 + leg] >= gains.contact_force else 0.0


@compiled
def outputs_at(state: np.record) -> Array:
    """Outputs y of the planner over `ground_height`: z, vx, vy, roll, pitch, wz (yaw frame)."""
    R, omega, velocity = state.R, state.omega, state.velocity
    rpy = roll_pitch_yaw(R)
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    return np.array(
        [
            state.position[2] - state.ground_height,
            c * velocity[0] + s * velocity[1],
            -s * velocity[0] + c * velocity[1],
            rpy[0],
            rpy[1],
            R[2, 0] * omega[0] + R[2, 1] * omega[1] + R[2, 2] * omega[2],
        ]
    )
