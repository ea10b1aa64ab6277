"""What a plant knows of the clock that leads the team: its offset and drift, with a true bound.

An ask leaves at `asked` of my clock, arrives at `received` of the leader's, is answered at
`answered` of the leader's and is back at `arrived` of mine. No message arrives before it was sent.
So with the offset `θ(t)`, the leader's reading minus mine when mine is t,

    θ(asked) ≤ received - asked,    θ(arrived) ≥ answered - arrived,

however long each way takes and however late the answer is. The offset changes by its drift `d`,
which is the same within `WANDER` over a window. All pairs of such limits bound `d`, and with `d`
all of them bound θ now: that is an interval, and its middle is the estimate. It is never wider than
what the exchange with the least round trip alone would tell.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array

WINDOW: Final = 64  # exchanges that are looked at
MAX_DRIFT: Final = 500e-6  # two clocks of computers do not run apart faster
WANDER: Final = 20e-6  # by which their drift may change within a window: warmth, NTP
PING_PONG: Final = "ping-pong"
SYSTEM_CLOCK: Final = "system clock"


@dataclass(frozen=True, slots=True)
class Exchange:
    """An ask and its answer, ns: `asked` and `arrived` of my clock, the others of the leader's."""

    asked: int
    received: int
    answered: int
    arrived: int

    @property
    def round_trip(self) -> int:
        """How long both messages were under way, ns."""
        return self.arrived - self.asked - (self.answered - self.received)


@dataclass(frozen=True, slots=True)
class WallReading:
    """A clock and the system's wall clock read at once, ns.

    Attributes:
        clock: the clock that is compared.
        wall: the wall clock.
        error: how far the wall clock may be off true time; 0: it is not synchronised.
    """

    clock: int
    wall: int
    error: int


@dataclass(frozen=True, slots=True)
class KnownOffset:
    """The leader's clock minus mine, ns, and how far that may be off, as of `at` of my clock.

    Attributes:
        drift: change of the offset per time of mine, 1.
        drift_error: how far that may be off.
        source: what it comes from.
    """

    at: int
    offset: int
    error: int
    drift: float
    drift_error: float
    source: str

    def at_time(self, now: int) -> KnownOffset:
        """The same knowledge at a later time of my clock."""
        age = now - self.at
        offset = self.offset + round(self.drift * age)
        error = self.error + ceil(self.drift_error * abs(age))
        return KnownOffset(now, offset, error, self.drift, self.drift_error, self.source)

    def to_mine(self, instant: int) -> int:
        """My clock's reading when the leader's shows `instant`."""
        return self.at + round((instant - self.offset - self.at) / (1.0 + self.drift))


class ClockEstimate:
    """The leader's clock, from exchanges and from both system clocks, whichever is better.

    Attributes:
        exchanges: those that are looked at, oldest first.
        contradicted: whether the system clocks have once told another offset than the exchanges,
            beyond both errors. They are not believed any more.
    """

    def __init__(self) -> None:
        self.exchanges: deque[Exchange] = deque(maxlen=WINDOW)
        self.contradicted = False
        self._by_exchanges: KnownOffset | None = None
        self._by_walls: KnownOffset | None = None

    @property
    def round_trip(self) -> int:
        """The least round trip of the exchanges, ns; 0 without any."""
        return min((exchange.round_trip for exchange in self.exchanges), default=0)

    def take(self, exchange: Exchange, leader: WallReading, mine: WallReading) -> None:
        """Learn from an exchange, and from both sides' wall clocks as read during it."""
        self.exchanges.append(exchange)
        found = offset_of(self.exchanges)
        while found is None:  # the drift has changed more than it may: only what came since counts
            for _ in range((len(self.exchanges) + 1) // 2):
                self.exchanges.popleft()
            if not self.exchanges:
                return
            found = offset_of(self.exchanges)
        self._by_exchanges = found
        self._by_walls = offset_of_walls(leader, mine, found)
        if self._by_walls is not None:
            apart = abs(self._by_walls.at_time(found.at).offset - found.offset)
            self.contradicted |= apart > self._by_walls.error + found.error

    def at_time(self, now: int) -> KnownOffset | None:
        """The better of both estimates; None before the first exchange."""
        if self._by_exchanges is None:
            return None
        best = self._by_exchanges.at_time(now)
        if self._by_walls is None or self.contradicted:
            return best
        walls = self._by_walls.at_time(now)
        return walls if walls.error < best.error else best


def offset_of(exchanges: deque[Exchange]) -> KnownOffset | None:
    """The offset when the newest of exchanges arrived; None if no steady drift explains them all.

    A newer limit at t and an older one at s bound the drift by what lies between them, over t - s.
    """
    base = exchanges[-1]
    about = base.received - base.asked  # of the size of an offset, so that floats are exact to ns
    # Limits, from above and below, and when they hold.
    upper_at = np.array([e.asked - base.arrived for e in exchanges], dtype=float)
    upper = np.array([e.received - e.asked - about for e in exchanges], dtype=float)
    lower_at = np.array([e.arrived - base.arrived for e in exchanges], dtype=float)
    lower = np.array([e.answered - e.arrived - about for e in exchanges], dtype=float)
    upper, lower = upper - WANDER * upper_at, lower + WANDER * lower_at  # the times are ≤ 0
    apart = lower_at[:, None] - upper_at[None, :]
    gap = lower[:, None] - upper[None, :]
    least = max(-MAX_DRIFT, _largest(gap, apart, apart > 0.0))
    greatest = min(MAX_DRIFT, -_largest(gap, -apart, apart < 0.0))
    if least > greatest or np.any(gap[apart == 0.0] > 0.0):
        return None
    high = float(np.min(upper - greatest * upper_at))
    low = float(np.max(lower - least * lower_at))
    return KnownOffset(
        at=base.arrived,
        offset=about + round(0.5 * (low + high)),
        error=ceil(0.5 * (high - low)) + 1,
        drift=0.5 * (least + greatest),
        drift_error=0.5 * (greatest - least) + WANDER,
        source=PING_PONG,
    )


def offset_of_walls(
    leader: WallReading, mine: WallReading, other: KnownOffset
) -> KnownOffset | None:
    """The offset that two synchronised wall clocks tell; None if one is not synchronised.

    A clock and the wall clock of one machine differ by a constant. The drift is that of `other`.
    """
    if not (leader.error and mine.error):
        return None
    offset = leader.clock - leader.wall - (mine.clock - mine.wall)
    error = leader.error + mine.error
    return KnownOffset(
        mine.clock, offset, error, other.drift, other.drift_error, source=SYSTEM_CLOCK
    )


def _largest(gap: Array, apart: Array, among: NDArray[np.bool_]) -> float:
    """The largest of gap / apart, shapes (m, n), where `among`; minus infinity if nowhere."""
    return float(np.max(gap[among] / apart[among], initial=-np.inf))
