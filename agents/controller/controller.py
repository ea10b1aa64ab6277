"""`control`: from a robot's state and a command to the torques of its motors.

In a tick: rigid-body terms, trunk, friction to count on, feet, whole-body QP. `estimate` and
`control` are a compiled call each: between two ticks the processor's caches are lost, so that a
tick costs what it goes through.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np

from quadriga.agents.controller.swing import foot_velocities, stance_forces, swing_accelerations
from quadriga.agents.controller.trunk import (
    COMMAND,
    TrunkCommand,
    accumulate_forces,
    trunk_reference,
)
from quadriga.agents.controller.whole_body_qp import (
    QP,
    WholeBodySolution,
    build_qp,
    solve_qp,
    torque_bounds,
)
from quadriga.agents.estimator.payload_friction import add_payload, update_mu_reduction
from quadriga.agents.estimator.rigid_body import rigid_body_terms
from quadriga.agents.estimator.robot_state import GAINS, ROBOT_STATE, RobotState
from quadriga.shared.robots.conventions import N_FORCES, Array
from quadriga.shared.robots.torque_speed import MotorCurves
from quadriga.shared.runtime.jit import compiled

_NUMBERS: Final = struct.Struct(f"={COMMAND.itemsize // 8 - N_FORCES}d")  # behind the deviation


def control(
    state: RobotState, command: TrunkCommand, gains: Array, *, new_sample: bool = False
) -> tuple[RobotState, WholeBodySolution]:
    """Torques for what a robot is asked to do, of its state by `estimate` and a `gains_row`.

    `new_sample` tells whether a sample of forces begins with this tick.

    Returns:
        The state to remember, with what the QP was asked for, and the QP with its answer.
    """
    qp, row = np.empty(QP.itemsize // 8), np.empty(len(state.row))
    free = control_rows(state.row, row, command_row(command, new_sample=new_sample), gains, qp)
    return RobotState(row), solve_qp(qp, free)


def command_row(command: TrunkCommand, *, new_sample: bool) -> Array:
    """The row of `COMMAND` that compiled code takes."""
    asked = np.empty(COMMAND.itemsize // 8)
    vx, vy, wz, height, asked[:N_FORCES], *rest = command
    # At once: each number that numpy is given by itself costs as much as this.
    _NUMBERS.pack_into(asked, 8 * N_FORCES, vx, vy, wz, height, *rest, new_sample)  # type: ignore[arg-type]
    return asked


@compiled
def control_rows(
    before: Array, after: Array, command_row: Array, gains_row: Array, qp: Array
) -> bool:
    """Fill the rows `after` and `qp`; whether no limit of the QP is active."""
    after[:] = before
    state, gains = after.view(ROBOT_STATE)[0], gains_row.view(GAINS)[0]
    command = command_row.view(COMMAND)[0]
    terms = rigid_body_terms(state.q, state.v, add_payload(gains.links, state.payload))

    deviation = accumulate_forces(state, command, gains.weight)
    state.acc_des[:] = trunk_reference(state, command, gains, deviation)
    state.v_foot[:] = foot_velocities(terms.J, state.v, state.p_foot)
    update_mu_reduction(state, gains)
    state.swing_acc_des[:] = swing_accelerations(state, command.wz, gains)
    state.force_des[:] = stance_forces(state, gains, deviation)

    motors = gains.motors
    bounds = torque_bounds(state.v_joint, MotorCurves(motors[0], motors[1], motors[2], motors[3]))
    return build_qp(terms, state, gains, bounds, qp)
