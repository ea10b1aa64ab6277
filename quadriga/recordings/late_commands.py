"""Which share of a robot's commands comes too late, from what the world counts in real time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from quadriga.plant.deadlines import DUE, LATE

# A share that a machine which keeps up stays under for every second: a command that is late once
# in a while is used one tick later, and nobody notices.
OVERLOAD: Final = 0.2


def late_shares(before: Mapping[str, int], now: Mapping[str, int]) -> dict[str, float]:
    """By robot the share of late commands between two reports of the world.

    Args:
        before: counters of the report before; nothing counts from the begin of the walk.
        now: counters of the newer report, see `quadriga.plant.deadlines.Deadlines.status`.
    """
    shares = {}
    for name, count in now.items():
        robot, _, what = name.rpartition(".")
        due = count - before.get(name, 0)
        if what == DUE and robot and due > 0:
            late = f"{robot}.{LATE}"
            shares[robot] = (now.get(late, 0) - before.get(late, 0)) / due
    return shares


def overloaded(shares: Mapping[str, float]) -> dict[str, float]:
    """Those of the robots whose commands are late too often."""
    return {robot: share for robot, share in sorted(shares.items()) if share > OVERLOAD}
