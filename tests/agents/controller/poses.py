"""States of one robot, with the feet where Pinocchio puts them: independent of our kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from quadriga.agents.controller.estimator import Estimate
from quadriga.agents.controller.foot_load import FootLoad
from quadriga.agents.controller.maths.rigid_body import RigidBodyTerms
from quadriga.agents.controller.model import RigidBody
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import FOOT_FRAMES, N_JOINTS, Array
from tests.a1 import STAND_HEIGHT, build_pinocchio_model, q_stand

MODEL = build_pinocchio_model()
FEET = tuple(MODEL.getFrameId(name) for name in FOOT_FRAMES)
BODY = RigidBody(A1)


@dataclass(frozen=True)
class Pose:
    """One state: Pinocchio's q (19,) and v (18,), and the same as an estimate."""

    q: Array
    v: Array
    estimate: Estimate

    def terms(self) -> RigidBodyTerms:
        """What the controller computes of it."""
        return BODY.terms(self.q, self.v)


def loaded_with(force: Array) -> FootLoad:
    """Feet that bear these forces, (4,), N."""
    return FootLoad(force, force >= Config().controller.contact_force)


def pose_of(q: Array, v: Array, foot_force: float = 30.0) -> Pose:
    """The pose of Pinocchio's coordinates (velocity of the trunk in the trunk's frame)."""
    data = MODEL.createData()
    pin.forwardKinematics(MODEL, data, q, v)
    pin.updateFramePlacements(MODEL, data)
    R = pin.Quaternion(q[3:7]).matrix()
    p_foot = np.array([data.oMf[frame].translation for frame in FEET])
    estimate = Estimate(
        q[:3].copy(),
        R @ v[:3],
        np.ascontiguousarray(R),
        v[3:6].copy(),
        p_foot,
        q[7:].copy(),
        v[6:].copy(),
        loaded_with(np.full(4, foot_force)),
        np.array([q[6], q[3], q[4], q[5]]),
    )
    return Pose(q, v, estimate)


def standing_pose(yaw: float = 0.0) -> Pose:
    """Standing still in the nominal pose."""
    quat = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, yaw)).coeffs()
    return pose_of(
        np.concatenate([[0.0, 0.0, STAND_HEIGHT], quat, q_stand()]), np.zeros(6 + N_JOINTS)
    )


def random_pose(rng: np.random.Generator, tilt: float = 0.3, speed: float = 1.0) -> Pose:
    """A pose near standing, at any place and heading, with everything moving."""
    roll, pitch = rng.uniform(-tilt, tilt, 2)
    quat = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, rng.uniform(-np.pi, np.pi))).coeffs()
    position = rng.uniform([-5.0, -5.0, 0.2], [5.0, 5.0, 0.3])
    joints = q_stand() + rng.uniform(-0.3, 0.3, N_JOINTS)
    v = speed * np.concatenate([rng.uniform(-1.0, 1.0, 6), rng.uniform(-5.0, 5.0, N_JOINTS)])
    return pose_of(np.concatenate([position, quat, joints]), v)
