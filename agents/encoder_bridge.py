"""What an agent believes of its joints' encoders; those that say what cannot be are held.

A reading is not believed that is beyond the joint's end stops, or that has jumped against the
joint's rate. Then the last angle is kept, at rest: a knee that is held for half a second where it
was is a small error beside one that is read as 0, on which a leg folds or kicks. An encoder is
believed again once it has agreed with itself for a while, and with the end stops.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.messages import State

_BELIEVED_AFTER: Final = 0.02  # s, for which a reading must agree once one did not
_BEYOND: Final = 0.3  # rad beyond an end stop; encoders have an error of their zero
_JUMP: Final = 0.1  # rad, of an angle against its rate from one reading to the next
_FASTEST: Final = 20.0  # rad/s, of such joints: where readings are missing, more may have happened

_Q: Final = State.CUTS["q_joint"]
_V: Final = State.CUTS["v_joint"]


class EncoderLayout(NamedTuple):
    """Where the row of what is remembered keeps what, by joint, (12,) each.

    Attributes:
        believed: angle that was believed last, rad.
        q, v: what was read last, rad and rad/s.
        agrees: time for which readings have been in agreement, s.
    """

    believed: slice
    q: slice
    v: slice
    agrees: slice


ENCODERS: Final = EncoderLayout(
    **places(believed=N_JOINTS, q=N_JOINTS, v=N_JOINTS, agrees=N_JOINTS)
)


class EncoderBridge:
    """Fixed data of what an agent believes of its encoders.

    Args:
        robot: its kind.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._lower = np.array(robot.lower) - _BEYOND
        self._upper = np.array(robot.upper) + _BEYOND

    def step(self, before: Array | None, state: State, dt: float) -> tuple[Array, State]:
        """What is remembered after a tick, and its state with what is believed of the encoders.

        Args:
            before: what was remembered, see `EncoderLayout`; None: nothing, all is believed.
            state: what was read; given back itself where all of it is believed.
            dt: time since the last reading, s.
        """
        if before is None:
            return _first(state), state
        row, read = before.copy(), state.row
        if _judge(row, read, self._lower, self._upper, dt):
            return row, state
        bridged = read.copy()
        _hold(bridged, row)
        return row, State.from_row(state.tick, state.stamp_ns, bridged)


def _first(state: State) -> Array:
    row = np.full(row_size(ENCODERS), _BELIEVED_AFTER)
    row[ENCODERS.believed] = row[ENCODERS.q] = state.q_joint
    row[ENCODERS.v] = state.v_joint
    return row


@compiled
def _judge(row: Array, state: Array, lower: Array, upper: Array, dt: float) -> bool:
    """Whether all encoders are believed; `row` is brought up to date."""
    q, v = state[_Q], state[_V]
    q0, v0 = row[ENCODERS.q], row[ENCODERS.v]
    agrees, believed = row[ENCODERS.agrees], row[ENCODERS.believed]
    whole, jump = True, _JUMP + _FASTEST * max(0.0, dt - 1e-3)
    for joint in range(N_JOINTS):
        follows = abs(q[joint] - q0[joint] - 0.5 * dt * (v0[joint] + v[joint])) <= jump
        within = lower[joint] <= q[joint] <= upper[joint]
        agrees[joint] = min(agrees[joint] + dt, 1.0) if follows and within else 0.0
        if agrees[joint] >= _BELIEVED_AFTER:
            believed[joint] = q[joint]
        else:
            whole = False
    q0[:], v0[:] = q, v
    return whole


@compiled
def _hold(state: Array, row: Array) -> None:
    """Put what is believed in place of what was read."""
    for joint in range(N_JOINTS):
        if row[ENCODERS.agrees][joint] < _BELIEVED_AFTER:
            state[_Q][joint] = row[ENCODERS.believed][joint]
            state[_V][joint] = 0.0
