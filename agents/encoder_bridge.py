"""What an agent believes of its joints' encoders; those that say what cannot be are held.

A reading is not believed that is beyond the joint's end stops, that has jumped against the joint's
rate, has drifted away from it, or, of a thigh, stays the same number while its leg moves. Then the
last angle is kept, at rest: a knee that is held for half a second where it was is a small error
beside one that is read as 0, on which a leg folds or kicks. An encoder is believed again once it
has agreed with itself for a while, and reads what is near to where the joint has been of late.
After a pause in which nothing was read, all that was believed is believed anew, wherever it is.
Soon a robot that lacks one stands (`agents.sensor_loss`); on a hip or knee that is stuck it walks
better than it stands.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.shared.robot.conventions import JOINT_NAMES, N_JOINTS, N_LEGS, Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.messages import State

_BELIEVED_AFTER: Final = 0.02  # s, for which a reading must agree once one did not
_BEYOND: Final = 0.3  # rad beyond an end stop; encoders have an error of their zero
_JUMP: Final = 0.1  # rad, of an angle against its rate from one reading to the next
_DRIFT: Final = 0.15  # rad, likewise, within the time of `_FORGET`; rates may lag by some ms
_RETURN: Final = 0.05  # rad, of one that had drifted, for it to be believed again
_FORGET: Final = 0.1  # s
_DISTRUST: Final = 0.1  # s more, for which one must agree that had drifted
_BESIDE: Final = 0.15  # rad beside the range of late, within which one is believed again
_RANGE_TIME: Final = 2.0  # s, within which that range narrows to where the joint is
_TRAVEL: Final = 0.5  # rad, of a leg's other joints together, for which none reads the same number
_MOVES: Final = 0.3  # rad/s, of a joint that is not at rest
_FASTEST: Final = 20.0  # rad/s, of such joints: where readings are missing, more may have happened
_PAUSE: Final = 0.05  # s between two readings, after which a joint may be anywhere

_OF_A_LEG: Final = N_JOINTS // N_LEGS
_THIGH: Final = 1  # of these
_Q: Final = State.CUTS["q_joint"]
_V: Final = State.CUTS["v_joint"]


class EncoderLayout(NamedTuple):
    """Where the row of what is remembered keeps what, by joint, (12,) each.

    Attributes:
        believed: angle that was believed last, rad.
        q, v: what was read last, rad and rad/s.
        agrees: time for which readings have been in agreement, s; less than 0 after a drift.
        drift: of the angle against the rate, of late, rad.
        least, most: of the angles that were believed of late, rad.
        travel: of the leg's other joints since the reading has changed, rad.
        held: time for which the joint has been held, s.
        longest: the longest of these times, s; one number.
    """

    believed: slice
    q: slice
    v: slice
    agrees: slice
    drift: slice
    least: slice
    most: slice
    travel: slice
    held: slice
    longest: int


ENCODERS: Final = EncoderLayout(
    **places(**dict.fromkeys(EncoderLayout._fields, N_JOINTS) | {"longest": 1})
)


class EncoderBridge:
    """Fixed data of what an agent believes of its encoders.

    Args:
        robot: its kind.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._lower = np.array(robot.lower) - _BEYOND
        self._upper = np.array(robot.upper) + _BEYOND
        # What a pause and a failure take is compiled, or loaded, now and not when they happen.
        nothing = State.from_row(0, 0, np.full(max(c.stop for c in State.CUTS.values()), np.nan))
        row, _ = self.step(None, nothing, 1e-3)
        self.step(row, nothing, 2.0 * _PAUSE)
        self.step(row, nothing, 1e-3)

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
        if dt > _PAUSE:
            all_believed = _begin_anew(row, read, self._lower, self._upper)
        else:
            all_believed = _judge(row, read, self._lower, self._upper, dt)
        if all_believed:
            return row, state
        bridged = read.copy()
        _hold(bridged, row)
        return row, State.from_row(state.tick, state.stamp_ns, bridged)


def joints_held(row: Array, most_ms: float | Array) -> tuple[int, ...]:
    """Joints (of the robot's 12) that have been held for longer than this, or each than its own."""
    if not row[ENCODERS.longest]:
        return ()
    return tuple(np.flatnonzero(1e3 * row[ENCODERS.held] > most_ms).tolist())


def name_joints(joints: Iterable[int]) -> str:
    """Names of some of the robot's 12 joints, as FL_calf,RR_hip."""
    return ",".join(JOINT_NAMES[joint].removesuffix("_joint") for joint in joints)


def _first(state: State) -> Array:
    row = np.full(row_size(ENCODERS), _BELIEVED_AFTER)
    for nothing in (ENCODERS.drift, ENCODERS.travel, ENCODERS.held, ENCODERS.longest):
        row[nothing] = 0.0
    for angle in (ENCODERS.believed, ENCODERS.q, ENCODERS.least, ENCODERS.most):
        row[angle] = state.q_joint
    row[ENCODERS.v] = state.v_joint
    return row


@compiled
def _judge(row: Array, state: Array, lower: Array, upper: Array, dt: float) -> bool:
    """Whether all encoders are believed; `row` is brought up to date."""
    q, v = state[_Q], state[_V]
    q0, v0 = row[ENCODERS.q], row[ENCODERS.v]
    agrees, believed, held = row[ENCODERS.agrees], row[ENCODERS.believed], row[ENCODERS.held]
    drift, kept = row[ENCODERS.drift], max(0.0, 1.0 - dt / _FORGET)
    least, most, travel = row[ENCODERS.least], row[ENCODERS.most], row[ENCODERS.travel]
    narrows = dt / _RANGE_TIME
    whole, jump = True, _JUMP + _FASTEST * max(0.0, dt - 1e-3)
    for joint in range(N_JOINTS):
        gained = q[joint] - q0[joint] - 0.5 * dt * (v0[joint] + v[joint])
        if not (abs(gained) <= jump and lower[joint] <= q[joint] <= upper[joint]):  # or no number
            agrees[joint] = min(agrees[joint], 0.0)
        else:
            agrees[joint] = min(agrees[joint] + dt, 1.0)
            drift[joint] = kept * drift[joint] + gained
        if agrees[joint] < _BELIEVED_AFTER:
            if not least[joint] - _BESIDE <= q[joint] <= most[joint] + _BESIDE:
                agrees[joint] = min(agrees[joint], 0.0)
            if agrees[joint] >= 0.0:
                drift[joint] = 0.0  # it begins anew after a jump
        if joint % _OF_A_LEG == _THIGH and q[joint] == q0[joint]:
            travel[joint] += dt * _speed_beside(q, q0, v, joint)
        else:
            travel[joint] = 0.0
        if travel[joint] > _TRAVEL:
            agrees[joint] = min(agrees[joint], 0.0)
        away = abs(drift[joint])
        if away > _DRIFT or (agrees[joint] < 0.0 and away > _RETURN):
            agrees[joint] = -_DISTRUST
            drift[joint] = min(max(drift[joint], -_DRIFT), _DRIFT)
        if agrees[joint] >= _BELIEVED_AFTER:
            believed[joint], held[joint] = q[joint], 0.0
            least[joint] = min(q[joint], least[joint] + narrows * (q[joint] - least[joint]))
            most[joint] = max(q[joint], most[joint] + narrows * (q[joint] - most[joint]))
        else:
            held[joint] += dt
            whole = False
    row[ENCODERS.longest] = held.max()
    q0[:], v0[:] = q, v
    return whole


@compiled
def _begin_anew(row: Array, state: Array, lower: Array, upper: Array) -> bool:
    """As `_judge`, after a pause in which the agent or its bus stood still.

    An encoder that was believed is, if it says what can be; nobody held a joint meanwhile.
    """
    q, v = state[_Q], state[_V]
    agrees, held, whole = row[ENCODERS.agrees], row[ENCODERS.held], True
    for joint in range(N_JOINTS):
        possible = lower[joint] <= q[joint] <= upper[joint] and np.isfinite(v[joint])
        if agrees[joint] >= _BELIEVED_AFTER and possible:
            for angle in (ENCODERS.believed, ENCODERS.least, ENCODERS.most):
                row[angle][joint] = q[joint]
            row[ENCODERS.drift][joint] = row[ENCODERS.travel][joint] = 0.0
        else:
            agrees[joint] = min(agrees[joint], 0.0)
            held[joint] += 1e-3
            whole = False
    row[ENCODERS.longest] = held.max()
    row[ENCODERS.q], row[ENCODERS.v] = q, v
    return whole


@compiled
def _speed_beside(q: Array, q0: Array, v: Array, joint: int) -> float:
    """How fast the other joints of a joint's leg move together, rad/s.

    One at rest trembles. Where all read what they did, the whole message is an old one.
    """
    speed, hip = 0.0, joint - joint % _OF_A_LEG
    for other in range(hip, hip + _OF_A_LEG):
        if other != joint and q[other] != q0[other] and abs(v[other]) > _MOVES:
            speed += abs(v[other])
    return speed


@compiled
def _hold(state: Array, row: Array) -> None:
    """Put what is believed in place of what was read."""
    for joint in range(N_JOINTS):
        if row[ENCODERS.agrees][joint] < _BELIEVED_AFTER:
            state[_Q][joint] = row[ENCODERS.believed][joint]
            state[_V][joint] = 0.0
