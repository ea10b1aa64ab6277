"""How far a source's time has come, by messages that anybody might have sent."""

from __future__ import annotations

from typing import Final

_NONE: Final = -1


class TickGate:
    """Believes ticks that go on from the newest one, and a jump once another tick goes on from it.

    One forged message far ahead would otherwise make all true ones late. Two of them in a row are
    believed: nothing in a tick tells who sent it.

    Args:
        step: a tick that is ahead by no more goes on, ms.
        most: no tick that is ahead by more is believed, ms. The first may be any: it tells the
            time.

    Attributes:
        newest: the newest tick that is believed, −1 before the first.
    """

    def __init__(self, step: int, most: int) -> None:
        self._step, self._most = step, most
        self._claimed = _NONE  # a jump that nothing has confirmed yet
        self.newest = _NONE

    def take(self, tick: int) -> bool:
        """Whether a tick is newer than `newest` and believed; it then is the newest."""
        if tick <= self.newest:
            return False
        first = self.newest == _NONE
        if self._goes_on(tick) or (self._confirms(tick) and (first or self._is_possible(tick))):
            self.newest, self._claimed = tick, _NONE
            return True
        self._claimed = tick
        return False

    def trust(self, tick: int) -> None:
        """Let `tick` go on from the newest, wherever that is: a replay knows that it was taken."""
        self.newest = max(self.newest, tick - 1)

    def _goes_on(self, tick: int) -> bool:
        return tick <= max(self.newest, 0) + self._step

    def _confirms(self, tick: int) -> bool:
        return self._claimed != _NONE and 0 < tick - self._claimed <= self._step

    def _is_possible(self, tick: int) -> bool:
        return tick <= self.newest + self._most
