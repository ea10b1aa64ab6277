"""By when the world had reached a tick, from what was heard of its clock. Pure."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from quadriga.shared.errors import ProcessError


class TickTimes:
    """Latest times of ticks.

    The clock tells every tenth tick, and what is heard was said before: so a tick was reached no
    later than the first message of it, or of a later one, was heard.

    Args:
        lines: `tick ns`, as `clock_listener` writes them.

    Raises:
        ProcessError: there are none.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        heard = np.array([line.split() for line in lines], dtype=np.int64).reshape(-1, 2)
        if not len(heard):
            raise ProcessError("the team's clock", "no message", "one every 10 ms")
        heard = heard[np.argsort(heard[:, 0], kind="stable")]
        self._ticks = heard[:, 0]
        self._times = np.minimum.accumulate(heard[::-1, 1])[::-1]

    def latest(self, tick: int) -> int | None:
        """Time by which the world had reached a tick, ns; None if it was not heard to."""
        at = int(np.searchsorted(self._ticks, tick))
        return int(self._times[at]) if at < len(self._times) else None
