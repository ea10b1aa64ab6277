"""Whether a loop that should run often gets too little of the processors. Pure."""

from __future__ import annotations

from typing import Final

PATIENCE: Final = 0.05  # s between two looks that are nothing to worry about
WINDOW: Final = 1.0  # s over which waiting is summed up
SHARE: Final = 0.3  # of the window that was spent beyond that, from which on the loop starves


class Starvation:
    """How long a loop has had to wait between its looks, as it tells with each.

    Args:
        now: time of the first look, s.
    """

    def __init__(self, now: float) -> None:
        self._begun = self._last = now
        self._waited = 0.0

    def look(self, now: float) -> bool:
        """Note a look at time `now`, s; whether the loop starved in the window that now ends."""
        self._waited += max(0.0, now - self._last - PATIENCE)
        self._last = now
        if now - self._begun < WINDOW:
            return False
        starves = self._waited > SHARE * (now - self._begun)
        self._begun, self._waited = now, 0.0
        return starves
