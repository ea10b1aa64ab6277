"""Who fell in a walk, and when: one rule for summaries and statistics.

A robot fell when the world said so, or when its truth shows it on the ground without leave. Leave
is given as the world gives it (`expect_down` of `quadriga.sim_server.world.world.World`): a robot
that is led down since its commands are lost may lie, but not tip over; one that is damped by an
emergency stop may do both. Either holds until the robot is up again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from quadriga.recordings.traces import Traces
from quadriga.recordings.truth import TruthTrace
from quadriga.shared.codes import ESTOPPED, FALL, LOWERED, RESET
from quadriga.shared.messages import Event

_LEAVES: Final = frozenset((ESTOPPED, LOWERED, RESET))


def find_falls(traces: Traces) -> dict[str, int]:
    """The tick of each robot's first fall, by robot; nothing of robots that did not fall.

    What happened before a stop counts as ever. Without truth the world's word alone tells.
    """
    falls = {event.robot: event.tick for event in reversed(traces.events) if event.code == FALL}
    for i, robot in enumerate(traces.robots):
        leaves = (e for e in traces.events if e.code in _LEAVES and e.robot in ("", robot))
        seen = _first_seen(traces.truth, i, sorted(leaves, key=lambda event: event.tick))
        if seen is not None:
            falls[robot] = min(seen, falls.get(robot, seen))
    return dict(sorted(falls.items()))


def _first_seen(truth: TruthTrace, i: int, leaves: Sequence[Event]) -> int | None:
    """The first tick at which the truth shows robot `i` on the ground without leave."""
    down = np.flatnonzero(truth.down[:, i])
    if not len(down):
        return None
    leave = _Leave(leaves)
    if not leaves or truth.tick[down[0]] <= leaves[0].tick:
        return int(truth.tick[down[0]])
    samples = (truth.tick, truth.tilted[:, i], truth.low[:, i], truth.up[:, i])
    for tick, tilted, low, up in zip(*(column.tolist() for column in samples), strict=True):
        leave.hear(tick)
        if up:
            leave.note_up()
        elif (tilted or low) and not leave.allows(tilted, low):
            return int(tick)
    return None


class _Leave:
    """What one robot may do without a fall, as its walk goes on.

    Args:
        events: that give leave or take it, in the order of their ticks.
    """

    def __init__(self, events: Sequence[Event]) -> None:
        self._coming = list(reversed(events))
        self._stopped = self._led_down = False  # what is in force
        self._may_lie = self._tipped = self._has_sunk = False  # since then, until it is up again

    def hear(self, tick: int) -> None:
        """Take in what was announced before a tick: the world steps after its words."""
        while self._coming and self._coming[-1].tick < tick:
            code = self._coming.pop().code
            if code == RESET:
                self._stopped = False
                continue
            self._may_lie = True
            if code == ESTOPPED:
                self._stopped = True
            else:
                self._led_down, self._has_sunk = True, False

    def allows(self, tilted: bool, low: bool) -> bool:
        """Whether the robot may be tilted or low now."""
        if (tilted and not (self._stopped or self._tipped)) or (low and not self._may_lie):
            return False
        self._has_sunk = True
        self._tipped |= tilted
        return True

    def note_up(self) -> None:
        """The robot stands: leave is over, unless it is stopped or has yet to come down.

        No event tells when commands of a robot that is led down are back.
        """
        if not self._stopped and (self._has_sunk or not self._led_down):
            self._led_down = self._may_lie = self._tipped = self._has_sunk = False
