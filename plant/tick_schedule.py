"""When the ticks of a plant begin: a millisecond apart on the team's clock, without jumps.

A correction of the clock moves the instants to come by a share of it with each tick: one of a
millisecond by 50 µs. No two ticks are less than half a millisecond apart, nor more than four, and
that only while the team waits for a plant that is far behind. A tick that begins late moves
nothing: those after it begin half a millisecond apart until they are on time. But what is late
already need not be moved any more where the team's time is delayed.
"""

from __future__ import annotations

from typing import Final

TICK_NS: Final = 1_000_000
LEAST_GAP_NS: Final = TICK_NS // 2  # between the beginnings of two ticks
_MOST_EARLIER_NS: Final = TICK_NS // 2  # that a tick is moved against the one before
_MOST_LATER_NS: Final = 3 * TICK_NS
_GAIN: Final = 0.05  # share of what is left that a tick corrects: 1 ms is gone in 60 ticks


class TickSchedule:
    """The instants at which ticks are to begin, ns of the plant's own clock.

    Args:
        first: that of the first tick.

    Attributes:
        planned: when the newest tick was to begin.
        begun: when it began.
    """

    def __init__(self, first: int) -> None:
        self.planned = self.begun = first - TICK_NS

    def plan(self, due: int) -> int:
        """Plan the next tick, which is due at an instant by the team's clock; when to begin it."""
        self.planned = max(self.planned, min(self.begun, due - TICK_NS))
        shift = _GAIN * (due - self.planned - TICK_NS)
        shift = max(-_MOST_EARLIER_NS, min(shift, _MOST_LATER_NS))
        self.planned += TICK_NS + round(shift)
        return max(self.planned, self.begun + LEAST_GAP_NS)

    def begin(self, now: int) -> None:
        """Note that the planned tick begins now."""
        self.begun = now
