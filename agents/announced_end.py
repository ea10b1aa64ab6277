"""The announced end of a walk: whoever reaches the bus may announce one that does not come."""

from __future__ import annotations

from typing import Final

from quadriga.agents.planning.references import AHEAD_MS

_NONE: Final = -1


class AnnouncedEnd:
    """The tick for which the end of the walk is announced, forgotten once time goes on."""

    def __init__(self) -> None:
        self._tick = _NONE

    @property
    def awaited(self) -> bool:
        """Whether an end has been announced, and time has not gone on since."""
        return self._tick != _NONE

    def announce(self, tick: int, newest: int) -> None:
        """Hear that the walk ends at `tick`, which counts as at most 1 s after `newest`.

        Args:
            tick: as announced.
            newest: last tick that is known to have been, −1 before the first.
        """
        self._tick = min(tick, max(newest, 0) + AHEAD_MS)

    def pass_tick(self, tick: int) -> None:
        """See that the team's time has reached `tick`."""
        if tick > self._tick:
            self._tick = _NONE
