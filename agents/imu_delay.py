"""Whether an IMU is late: the legs tell at once how the trunk turns, a late IMU tells it later.

Feet that stand do not move, so that two of them tell how the trunk turns about all axes but the
line through both. Where a foot slides they tell something else; but then what the gyro says is not
what the legs have said a while ago. A trunk whose IMU is 50 ms late is shaken by its own controller
and overturned within half a second, which is why a late IMU must not be believed.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.maths.leg_kinematics import leg_kinematics
from quadriga.agents.controller.maths.rotation import cross
from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.agents.controller.memory import MEMORY, Memory
from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import Geometry, RobotSpec
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.messages import State

_LAGS: Final = np.array([0, *range(30, 121, 10)])  # ms, the first: an IMU that is not late
_SPAN: Final = 121  # ms, of what is remembered of the legs
_TIME_MS: Final = 40.0  # time constant of the means
_DISAGREES: Final = 0.2  # (rad/s)², of the gyro with what the legs say now: it is this far off
_UNLIKE: Final = 0.5  # at least this share of what it says,
_ALIKE: Final = 0.15  # and of what they said a while ago by at most this share
_DOUBT_MS: Final = 400.0  # for which an IMU that was late is not believed
_LONG_DOUBT_MS: Final = 1000.0  # if it is late again: a robot that walks stands meanwhile
_AGAIN_MS: Final = 3000.0  # from the begin of a doubt, for which another one is a long one
_PAIRS: Final = ((0, 3), (1, 2))  # FL and RR, FR and RL: as a trot puts them down

_Q: Final = State.CUTS["q_joint"]  # of `State.row`
_V: Final = State.CUTS["v_joint"]
_GYRO: Final = State.CUTS["imu_gyro"]
_TURN, _LINE = slice(0, 3), slice(3, 6)  # of what the legs say at a millisecond
_SAID: Final = 6  # 1 if they say anything
_LEGS: Final = 7


class DelayLayout(NamedTuple):
    """Where the row of what is remembered keeps what.

    Attributes:
        legs: what the legs said at each of the last `_SPAN` ms, by tick modulo `_SPAN`, (121, 7):
            the trunk's rate across the line through two feet that stand, rad/s, that line, both in
            the trunk's frame, and whether they said anything.
        misfit: mean square of what the gyro says less what the legs said, by lag, (rad/s)².
        power: mean square of what the gyro says across that line, by lag, (rad/s)².
        doubt: for how long the IMU is not believed, ms.
        again: for how long another delay is one of several, ms.
    """

    legs: slice
    misfit: slice
    power: slice
    doubt: int
    again: int


DELAY: Final = DelayLayout(
    **places(legs=_SPAN * _LEGS, misfit=len(_LAGS), power=len(_LAGS), doubt=1, again=1)
)


class Delay(NamedTuple):
    """What is known of an IMU's delay.

    Attributes:
        row: what is remembered, see `DelayLayout`.
        late: whether the IMU is, or was a while ago, and is not to be believed.
    """

    row: Array
    late: bool


def no_delay() -> Delay:
    """What is known before the first tick."""
    return Delay(np.zeros(row_size(DELAY)), late=False)


def find_delay(
    before: Delay, state: State, memory: Memory | None, ticks: int, robot: RobotSpec
) -> Delay:
    """What is known after a tick.

    Args:
        before: what was known.
        state: what the robot measures.
        memory: of the low level, which knows the feet that stand; None: it has none yet.
        ticks: from the last one to this one, ms.
        robot: its kind.
    """
    row = before.row.copy()
    stands = np.zeros(4) if memory is None else _standing(memory.flat)
    return Delay(row, _find(row, state.row, state.tick, stands, ticks, robot.geometry))


@compiled
def _standing(memory: Array) -> Array:
    """Which feet stand by the schedule and bear load, (4,), 0 or 1."""
    return memory[MEMORY.contact] * (1.0 - memory[MEMORY.early_contact])


@compiled
def _find(
    row: Array, state: Array, tick: int, stands: Array, ticks: int, geometry: Geometry
) -> bool:
    legs = row[DELAY.legs].reshape(_SPAN, _LEGS)
    for passed in range(min(ticks, _SPAN)):
        legs[(tick - passed) % _SPAN, _SAID] = 0.0
    _listen(legs[tick % _SPAN], state, stands, geometry)
    misfit, power = row[DELAY.misfit], row[DELAY.power]
    _compare(misfit, power, legs, state[_GYRO], tick)
    row[DELAY.doubt] = max(0.0, row[DELAY.doubt] - ticks)
    row[DELAY.again] = max(0.0, row[DELAY.again] - ticks)
    if row[DELAY.doubt] <= 0.0 and _is_late(misfit, power):
        row[DELAY.doubt] = _LONG_DOUBT_MS if row[DELAY.again] > 0.0 else _DOUBT_MS
        row[DELAY.again] = _AGAIN_MS
    return bool(row[DELAY.doubt] > 0.0)


@compiled
def _listen(said: Array, state: Array, stands: Array, geometry: Geometry) -> None:
    """Note what the legs say now of how the trunk turns, if two of a pair stand.

    With feet at p₁ and p₂ that do not move, ω × d = v₂ − v₁ for d = p₁ − p₂ and the velocities v of
    the feet as seen from the trunk; hence ω less its part along d is d × (v₂ − v₁) / |d|².
    """
    for first, second in _PAIRS:
        if stands[first] > 0.5 and stands[second] > 0.5:
            place, velocity, _ = leg_kinematics(state[_Q], state[_V], geometry)
            line = place[first] - place[second]
            length2 = np.sum(line * line)
            said[_TURN] = cross(line, velocity[second] - velocity[first]) / length2
            said[_LINE] = line / np.sqrt(length2)
            said[_SAID] = 1.0
            return


@compiled
def _compare(misfit: Array, power: Array, legs: Array, gyro: Array, tick: int) -> None:
    """Bring the means up to date, at lags at which legs have said something."""
    if legs[tick % _SPAN, _SAID] < 0.5:
        return
    for index in range(len(_LAGS)):
        said = legs[(tick - _LAGS[index]) % _SPAN]
        if said[_SAID] < 0.5:
            continue
        turn = gyro - np.sum(gyro * said[_LINE]) * said[_LINE]
        error = turn - said[_TURN]
        misfit[index] += (np.sum(error * error) - misfit[index]) / _TIME_MS
        power[index] += (np.sum(turn * turn) - power[index]) / _TIME_MS


@compiled
def _is_late(misfit: Array, power: Array) -> bool:
    """Whether the gyro says what the legs said a while ago, and not what they say now."""
    if misfit[0] < max(_DISAGREES, _UNLIKE * power[0]):
        return False
    for index in range(1, len(misfit)):
        if misfit[index] < _ALIKE * power[index] and power[index] > _DISAGREES:
            return True
    return False
