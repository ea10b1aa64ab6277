"""The A1's numbers, and functions that ask for a robot with the A1 filled in, for tests of it."""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from quadriga.agents import gait, rehearsal
from quadriga.agents.estimator import estimator, kinematics
from quadriga.agents.estimator.robot_state import RobotState, gains_row
from quadriga.agents.planner import qp
from quadriga.agents.planner.qp import PlannerProblem
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.messages import State
from quadriga.shared.robots import pinocchio_model
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import Array

GEOMETRY: Final = A1.geometry
WEIGHT: Final = A1.weight
TOTAL_MASS: Final = A1.mass
TORQUE_LIMIT: Final = A1.torque[0]  # the same for all joints
STAND_HEIGHT: Final = A1.stand_height
FOOT_RADIUS: Final = GEOMETRY.foot_radius


def q_stand() -> Array:
    """Joint angles of the standing robot, (12,), rad."""
    return A1.q_stand.copy()


def nominal_forces(stance: NDArray[np.bool_]) -> Array:
    """See `gait.nominal_forces`."""
    return gait.nominal_forces(stance, WEIGHT)


def standing(tick: int, lean: float = 0.0) -> State:
    """See `rehearsal.standing`."""
    return rehearsal.standing(A1, tick, lean)


def standing_state(state: State) -> RobotState:
    """See `estimator.standing_state`."""
    return estimator.standing_state(state, gains_row(Config()))


def leg_kinematics(q_joint: Array, v_joint: Array) -> tuple[Array, Array, Array]:
    """See `kinematics.leg_kinematics`."""
    return kinematics.leg_kinematics(q_joint, v_joint, GEOMETRY)


def build_pinocchio_model() -> pin.Model:
    """See `pinocchio_model.build_pinocchio_model`."""
    return pinocchio_model.build_pinocchio_model(A1)


def build_problem(
    config: PlannerConfig, G_u: Array, stance: NDArray[np.bool_], G_past: Array | None = None
) -> PlannerProblem:
    """See `qp.build_problem`."""
    return qp.build_problem(config, WEIGHT, G_u, stance, G_past)
