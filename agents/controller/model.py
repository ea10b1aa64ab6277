"""Rigid-body terms of one robot from Pinocchio, in the form the whole-body QP takes them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from shared.a1_model import build_pinocchio_model
from shared.record import record
from shared.robot import Array, q_stand


@record
class Terms:
    """Terms of M(q) v̇ + h(q, v) = S τ + Jᵀ f at one instant (Pinocchio's coordinates).

    Attributes:
        M_inverse: inverse mass matrix, (18, 18).
        nle: Coriolis, centrifugal and gravity terms h, (18,).
        J: spatial Jacobians of all joints, world frame, (6, 18), linear rows first.
        dJ: its time derivative, (6, 18).
        v: generalised velocity; the trunk's in the trunk frame, (18,).
    """

    M_inverse: Array
    nle: Array
    J: Array
    dJ: Array
    v: Array


class RigidBody:
    """Pinocchio's model of one A1 with its scratch memory."""

    def __init__(self) -> None:
        self.model = build_pinocchio_model()
        self._scratch = self.model.createData()
        self.mass: float = float(pin.computeTotalMass(self.model))
        self.inertia_inverse, self.com = self._single_rigid_body()

    def _single_rigid_body(self) -> tuple[Array, Array]:
        """Inverse composite inertia about the centre of mass, and that centre, trunk frame."""
        q = pin.neutral(self.model)
        q[7:] = q_stand()
        pin.ccrba(self.model, self._scratch, q, np.zeros(self.model.nv))
        com = pin.centerOfMass(self.model, self._scratch, q)
        return np.linalg.inv(self._scratch.Ig.inertia), np.array(com)

    def terms(self, q: Array, v: Array) -> Terms:
        """Terms at Pinocchio's coordinates, (19,) and (18,), quaternion normalised."""
        scratch = self._scratch
        M_inverse = pin.computeMinverse(self.model, scratch, q)
        nle = pin.nonLinearEffects(self.model, scratch, q, v)
        pin.computeJointJacobiansTimeVariation(self.model, scratch, q, v)
        return Terms(M_inverse, nle, scratch.J, scratch.dJ, v)
