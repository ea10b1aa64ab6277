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
from quadriga.agents.controller.memory import MEMORY
from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import Geometry
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.messages import State

_LAGS: Final = np.array([0, *range(30, 121, 10)])  # ms, the first: an IMU that is not late
_SPAN: Final = 121  # ms, of what is remembered of the legs
_TIME_MS: Final = 40.0  # time constant of the means
_DISAGREES: Final = 0.2  # (rad/s)², of the gyro with what the legs say now: it is this far off
_UNLIKE: Final = 0.5  # at least this share of what it says,
_ALIKE: Final = 0.1  # and of what they said a while ago by at most this share
_SEEN_MS: Final = 30.0  # for which that must be so: where feet slide, it is for less, by chance
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
        turn: the trunk's rate as far as the legs tell it now, (3,), rad/s, trunk's frame: nothing
            about the line through two feet that stand, and nothing at all without two.
        seen: for how long the IMU has seemed late, ms.
        doubt: for how long the IMU is not believed, ms.
        again: for how long another delay is one of several, ms.
    """

    legs: slice
    misfit: slice
    power: slice
    turn: slice
    seen: int
    doubt: int
    again: int


DELAY: Final = DelayLayout(
    **places(
        legs=_SPAN * _LEGS, misfit=len(_LAGS), power=len(_LAGS), turn=3, seen=1, doubt=1, again=1
    )
)


def nothing_said() -> Array:
    """What is remembered before the first tick."""
    return np.zeros(row_size(DELAY))


@compiled
def find_delay(
    row: Array, state: Array, memory: Array, tick: int, ticks: int, geometry: Geometry
) -> bool:
    """Whether the IMU is late, or was a while ago, and is not to be believed.

    Args:
        row: what is remembered, see `DelayLayout`; brought up to date.
        state: what the robot measures, `State.row`.
        memory: of the low level, which knows the feet that stand, `Memory.flat`.
        tick: the present one.
        ticks: from the last one to this one, ms.
        geometry: of the legs.
    """
    legs = row[DELAY.legs].reshape(_SPAN, _LEGS)
    for passed in range(min(ticks, _SPAN)):
        legs[(tick - passed) % _SPAN, _SAID] = 0.0
    said = legs[tick % _SPAN]
    _listen(said, state, memory, geometry)
    row[DELAY.turn] = said[_SAID] * said[_TURN]
    misfit, power = row[DELAY.misfit], row[DELAY.power]
    if said[_SAID] > 0.5:
        _compare(misfit, power, legs, state[_GYRO], tick)
    row[DELAY.doubt] = max(0.0, row[DELAY.doubt] - ticks)
    row[DELAY.again] = max(0.0, row[DELAY.again] - ticks)
    row[DELAY.seen] = row[DELAY.seen] + ticks if _seems_late(misfit, power) else 0.0
    if row[DELAY.doubt] <= 0.0 and row[DELAY.seen] >= _SEEN_MS:
        row[DELAY.doubt] = _LONG_DOUBT_MS if row[DELAY.again] > 0.0 else _DOUBT_MS
        row[DELAY.again] = _AGAIN_MS
    return bool(row[DELAY.doubt] > 0.0)


@compiled
def _listen(said: Array, state: Array, memory: Array, geometry: Geometry) -> None:
    """Note what the legs say now of how the trunk turns, if two of a pair stand.

    With feet at p₁ and p₂ that do not move, ω × d = v₂ − v₁ for d = p₁ − p₂ and the velocities v of
    the feet as seen from the trunk; hence ω less its part along d is d × (v₂ − v₁) / |d|².
    """
    contact, early = memory[MEMORY.contact], memory[MEMORY.early_contact]
    for first, second in _PAIRS:
        if min(contact[first], contact[second]) < 0.5 or max(early[first], early[second]) > 0.5:
            continue
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
    share = 1.0 / _TIME_MS
    for index in range(len(_LAGS)):
        said = legs[(tick - _LAGS[index]) % _SPAN]
        if said[_SAID] < 0.5:
            continue
        told, line = said[_TURN], said[_LINE]
        along = gyro[0] * line[0] + gyro[1] * line[1] + gyro[2] * line[2]
        error2, turn2 = 0.0, 0.0
        for axis in range(3):
            turn = gyro[axis] - along * line[axis]
            turn2 += turn * turn
            error2 += (turn - told[axis]) ** 2
        misfit[index] += share * (error2 - misfit[index])
        power[index] += share * (turn2 - power[index])


@compiled
def _seems_late(misfit: Array, power: Array) -> bool:
    """Whether the gyro says what the legs said a while ago, and not what they say now."""
    if misfit[0] < max(_DISAGREES, _UNLIKE * power[0]):
        return False
    for index in range(1, len(misfit)):
        if misfit[index] < _ALIKE * power[index] and power[index] > _DISAGREES:
            return True
    return False
