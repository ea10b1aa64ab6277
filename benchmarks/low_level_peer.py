"""The whole-body QP as a user of TSID writes it; imported only where `tsid` is installed.

Decision variables are accelerations and forces. No slip, dynamics, friction cone and torque limits
are constraints; trunk, swing feet and forces are in the cost with our weights. TSID's Python
interface takes no cost on torques: that small term is not in it, which spares it some work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
import tsid

from quadriga.shared.config.sections import ControllerConfig
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import FOOT_FRAMES, Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model

if TYPE_CHECKING:
    from benchmarks.low_level_ticks import TsidCase

_TRUNK = "root_joint"
_POSITION = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


class Tsid:
    """One A1 with four feet, each of which is a contact or a task at a tick."""

    def __init__(self, weights: ControllerConfig) -> None:
        self._weights = weights
        model = build_pinocchio_model(A1)
        self._robot = tsid.RobotWrapper(model, tsid.FLOATING_BASE_SYSTEM, False)
        self._form = tsid.InverseDynamicsFormulationAccForce("tsid", self._robot, False)
        self._v0 = np.zeros(model.nv)
        q0 = pin.neutral(model)
        self._form.computeProblemData(0.0, q0, self._v0)
        self._trunk = self._se3("trunk", _TRUNK, np.ones(6))
        self._form.addMotionTask(self._trunk, weights.gamma_defect, 1, 0.0)
        limit = A1.torque_limit
        self._bounds = tsid.TaskActuationBounds("limits", self._robot)
        self._bounds.setBounds(-limit, limit)
        self._form.addActuationTask(self._bounds, 1.0, 0, 0.0)
        self._feet = [self._se3(f"swing_{name}", name, _POSITION) for name in FOOT_FRAMES]
        self._contacts = [self._contact(name) for name in FOOT_FRAMES]
        self._standing: list[bool | None] = [None] * 4
        self._solver = tsid.SolverHQuadProgFast("solver")
        self._solution: Any = None

    def _se3(self, name: str, frame: str, mask: Array) -> Any:
        """A task without feedback: its reference is the acceleration itself, world-aligned."""
        task = tsid.TaskSE3Equality(name, self._robot, frame)
        task.setKp(np.zeros(6))
        task.setKd(np.zeros(6))
        task.setMask(mask)
        task.useLocalFrame(False)
        return task

    def _contact(self, frame: str) -> Any:
        contact = tsid.ContactPoint(
            f"contact_{frame}",
            self._robot,
            frame,
            np.array([0.0, 0.0, 1.0]),
            self._weights.mu / np.sqrt(2.0),
            self._weights.force_min,
            1e3,
        )
        contact.setKp(np.zeros(3))
        contact.setKd(np.zeros(3))
        contact.useLocalFrame(False)
        contact.setRegularizationTaskWeightVector(np.ones(3))
        return contact

    def set(self, case: TsidCase) -> None:
        """References and contacts of a tick."""
        asked, changed = case.state, False
        for leg, standing in enumerate(asked.contact > 0.5):
            if standing != self._standing[leg]:
                self._switch(leg, bool(standing), first=self._standing[leg] is None)
                self._standing[leg], changed = bool(standing), True
            if standing:
                self._contacts[leg].setForceReference(asked.force_des[leg])
            else:
                swing = np.append(asked.swing_acc_des[leg], np.zeros(3))
                self._feet[leg].setReference(_accelerate(swing))
        self._trunk.setReference(_accelerate(asked.acc_des))
        if changed:
            self._form.computeProblemData(0.0, case.state.q, case.state.v)
            self._solver.resize(self._form.nVar, self._form.nEq, self._form.nIn)

    def _switch(self, leg: int, standing: bool, *, first: bool) -> None:
        task, contact = self._feet[leg], self._contacts[leg]
        if standing:
            if not first:
                self._form.removeTask(task.name, 0.0)
            self._form.addRigidContact(contact, self._weights.gamma_force, 1.0, 0)
        else:
            if not first:
                self._form.removeRigidContact(contact.name, 0.0)
            self._form.addMotionTask(task, self._weights.gamma_defect, 1, 0.0)

    def solve(self, case: TsidCase) -> None:
        """Solve the problem of a tick with TSID."""
        problem = self._form.computeProblemData(0.0, case.state.q, case.state.v)
        self._solution = self._solver.solve(problem)

    def torques(self) -> Array:
        """Of the last tick, (12,), N·m."""
        tau: Array = np.array(self._form.getActuatorForces(self._solution))
        return tau


def _accelerate(acceleration: Array) -> Any:
    """A sample of a trajectory whose position and velocity do not matter."""
    sample = tsid.TrajectorySample(12, 6)
    pose = np.zeros(12)
    pose[3:] = np.eye(3).ravel()
    sample.value(pose)
    sample.derivative(np.zeros(6))
    sample.second_derivative(acceleration)
    return sample
