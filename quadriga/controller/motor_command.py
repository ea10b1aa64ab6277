"""A motor command for a state, from what a controller has to say of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Command, State
from quadriga.shared.robots.conventions import N_JOINTS

CAUSE = "see docs/messages.md#command"


def build_command(
    state: State,
    *,
    tau: ArrayLike = 0.0,
    q_des: ArrayLike = 0.0,
    v_des: ArrayLike = 0.0,
    kp: ArrayLike = 0.0,
    kd: ArrayLike = 0.0,
) -> Command:
    """The command that answers a state; motors apply `tau + kp (q_des − q) + kd (v_des − v)`.

    Each field is an array (12,) in the order of the joints, or one number for all of them.

    Args:
        state: what it answers.
        tau: torque, N·m.
        q_des: angle, rad.
        v_des: rate, rad/s.
        kp: stiffness, N·m/rad.
        kd: damping, N·m·s/rad.

    Raises:
        ProcessError: a field has another shape.
    """
    fields = {"tau": tau, "q_des": q_des, "v_des": v_des, "kp": kp, "kd": kd}
    row = np.empty(len(fields) * N_JOINTS)
    for name, value in fields.items():
        shape = np.shape(value)
        if shape not in ((), (N_JOINTS,)):
            raise ProcessError(f"command.{name}", f"shape {shape}", "() or (12,)", CAUSE)
        row[Command.CUTS[name]] = value
    return Command.from_row(state.tick, state.stamp_ns, row)
