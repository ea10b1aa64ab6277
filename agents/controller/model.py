"""The rigid body of one robot, in the form the whole-body QP takes it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from quadriga.agents.controller.maths.links import link_table
from quadriga.agents.controller.maths.rigid_body import RigidBodyTerms, rigid_body_terms
from quadriga.agents.controller.payload_estimate import add_load
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.spec import RobotSpec


def _single_rigid_body(model: pin.Model, q_joint: Array) -> tuple[Array, Array]:
    """Inverse composite inertia about the centre of mass, and that centre, in a pose."""
    q, scratch = pin.neutral(model), model.createData()
    q[7:] = q_joint
    pin.ccrba(model, scratch, q, np.zeros(model.nv))
    com = pin.centerOfMass(model, scratch, q)
    return np.linalg.inv(scratch.Ig.inertia), np.array(com)


class RigidBody:
    """What is constant of one robot, taken from Pinocchio's model of its URDF.

    Args:
        robot: its kind.
        rotors: whether its joints have the inertia of their motors' rotors.

    Attributes:
        links: `link_table`.
        mass: kg.
        com: centre of mass in the nominal pose, trunk frame, (3,), m.
        inertia_inverse: inverse of the inertia about it, trunk frame, (3, 3), 1/(kg·m²).
    """

    def __init__(self, robot: RobotSpec, *, rotors: bool = False) -> None:
        model = build_pinocchio_model(robot, rotors=rotors)
        self.links = link_table(model)
        self.mass: float = float(pin.computeTotalMass(model))
        self.inertia_inverse, self.com = _single_rigid_body(model, robot.q_stand)

    def terms(self, q: Array, v: Array, load: float = 0.0) -> RigidBodyTerms:
        """Terms at Pinocchio's coordinates, (19,) and (18,), of a robot with a load, kg.

        The quaternion is normalised.
        """
        terms: RigidBodyTerms = rigid_body_terms(q, v, add_load(self.links, load))
        return terms
