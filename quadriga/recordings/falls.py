"""Who fell in a walk, and when: one rule for summaries and statistics.

A robot fell when the world said so, or when its truth shows it on the ground. As in the world
(`expect_down` of `quadriga.sim_server.world.world.World`), one that an emergency stop has damped
does not fall until it has been up again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from quadriga.recordings.traces import Traces
from quadriga.recordings.truth import TruthTrace
from quadriga.shared.codes import ESTOPPED, FALL, RESET
from quadriga.shared.messages import Event

_STOPS: Final = frozenset((ESTOPPED, RESET))


def find_falls(traces: Traces) -> dict[str, int]:
    """The tick of each robot's first fall, by robot; nothing of robots that did not fall.

    What happened before a stop counts as ever. Without truth the world's events alone tell.
    """
    falls = {event.robot: event.tick for event in reversed(traces.events) if event.code == FALL}
    for i, robot in enumerate(traces.robots):
        stops = [e for e in traces.events if e.code in _STOPS and e.robot in ("", robot)]
        seen = _first_seen(traces.truth, i, sorted(stops, key=lambda event: event.tick))
        if seen is not None:
            falls[robot] = min(seen, falls.get(robot, seen))
    return dict(sorted(falls.items()))


def _first_seen(truth: TruthTrace, i: int, stops: Sequence[Event]) -> int | None:
    """The first tick at which the truth shows that robot `i` fell.

    Args:
        truth: of all robots.
        i: the robot's place among them.
        stops: emergency stops and their releases, in the order of their ticks.
    """
    down = np.flatnonzero(truth.down[:, i])
    if not len(down):
        return None
    coming, stopped, excused = list(reversed(stops)), False, False
    samples = zip(truth.tick.tolist(), truth.down[:, i], truth.up[:, i], strict=True)
    for tick, is_down, is_up in samples:
        while coming and coming[-1].tick < tick:  # the world steps after its events
            stopped = coming.pop().code == ESTOPPED
            excused |= stopped
        if is_up and not stopped:
            excused = False
        if is_down and not excused:
            return int(tick)
    return None
