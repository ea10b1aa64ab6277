"""States of one robot, with the feet where Pinocchio puts them: independent of our kinematics."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from quadriga.agents.estimator import robot_state
from quadriga.agents.estimator.payload_friction import add_payload
from quadriga.agents.estimator.rigid_body import RigidBodyTerms, rigid_body_terms
from quadriga.agents.estimator.robot_state import ROBOT_STATE, RobotState, gains_row
from quadriga.shared.config.sections import Config, MotorsConfig
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import FOOT_FRAMES, N_JOINTS, Array
from tests.a1 import STAND_HEIGHT, build_pinocchio_model, q_stand

MODEL = build_pinocchio_model()
FEET = tuple(MODEL.getFrameId(name) for name in FOOT_FRAMES)
DT = 1e-3


def gains_of(**controller: Any) -> Any:
    """The record of `GAINS` of an A1 without rotors with these keys of the controller."""
    config = Config(motors=MotorsConfig(friction=0.0, viscous_friction=0.0, rotor_inertia=False))
    config = replace(config, controller=replace(config.controller, **controller))
    return gains_row(config).view(robot_state.GAINS)[0]


GAINS = gains_of()


def record_of(state: RobotState) -> Any:
    """The record of a state, which may be changed."""
    return state.row.view(ROBOT_STATE)[0]


def blank() -> Any:
    """The record of a state of zeros, a tick after the last."""
    state = np.zeros(ROBOT_STATE.itemsize // 8).view(ROBOT_STATE)[0]
    state.dt, state.progress, state.half_cycle = DT, 0.5, -1.0
    return state


def read(state: Any, sensors: State) -> None:
    """Take the readings of a tick into a state."""
    state.q_joint, state.v_joint = sensors.q_joint, sensors.v_joint
    state.tau_joint, state.quat_wxyz = sensors.tau_joint, sensors.imu_quat_wxyz
    state.omega, state.accel = sensors.imu_gyro, sensors.imu_accel
    state.foot_counts = sensors.foot_force


def pose_of(q: Array, v: Array) -> Any:
    """The state at Pinocchio's coordinates (velocity of the trunk in the trunk's frame)."""
    data, state = MODEL.createData(), blank()
    pin.forwardKinematics(MODEL, data, q, v)
    pin.updateFramePlacements(MODEL, data)
    state.q, state.v, state.R = q, v, pin.Quaternion(q[3:7]).matrix()
    state.position, state.velocity, state.omega = q[:3], state.R @ v[:3], v[3:6]
    state.p_foot = [data.oMf[frame].translation for frame in FEET]
    state.q_joint, state.v_joint = q[7:], v[6:]
    state.quat_wxyz = q[6], q[3], q[4], q[5]
    state.foot_force, state.stance, state.contact, state.foot_loaded = 30.0, 1.0, 1.0, 1.0
    return state


def standing_pose(yaw: float = 0.0) -> Any:
    """Standing still in the nominal pose."""
    quat = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, yaw)).coeffs()
    state = pose_of(
        np.concatenate([[0.0, 0.0, STAND_HEIGHT], quat, q_stand()]), np.zeros(6 + N_JOINTS)
    )
    state.yaw_des = yaw
    return state


def random_pose(rng: np.random.Generator, tilt: float = 0.3, speed: float = 1.0) -> Any:
    """A pose near standing, at any place and heading, with everything moving."""
    roll, pitch = rng.uniform(-tilt, tilt, 2)
    quat = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, rng.uniform(-np.pi, np.pi))).coeffs()
    position = rng.uniform([-5.0, -5.0, 0.2], [5.0, 5.0, 0.3])
    joints = q_stand() + rng.uniform(-0.3, 0.3, N_JOINTS)
    v = speed * np.concatenate([rng.uniform(-1.0, 1.0, 6), rng.uniform(-5.0, 5.0, N_JOINTS)])
    return pose_of(np.concatenate([position, quat, joints]), v)


def terms_of(
    q: Array, v: Array, payload: float = 0.0, links: Array = GAINS.links
) -> RigidBodyTerms:
    """What the controller computes at Pinocchio's coordinates."""
    terms: RigidBodyTerms = rigid_body_terms(q, v, add_payload(links, payload))
    return terms
