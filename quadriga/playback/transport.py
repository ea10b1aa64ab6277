"""How far a playback has come: a position that moves with the clock, pauses and steps."""

from __future__ import annotations


class Transport:
    """A position in world time as a function of the clock's time, which is an argument.

    Attributes:
        rate: world time per wall time.
        paused: whether the position stands still.
    """

    def __init__(self, rate: float, position: float, now: float, *, paused: bool) -> None:
        """Begin at `position` ms when the clock shows `now` s."""
        self.rate, self.paused = rate, paused
        self._at, self._since = position, now

    def position(self, now: float) -> float:
        """World time reached, ms."""
        return self._at if self.paused else self._at + 1000 * self.rate * (now - self._since)

    def until(self, position: float, now: float) -> float:
        """Wall time from `now` until `position` is reached, s; infinite while paused."""
        ahead = position - self.position(now)
        if ahead <= 0.0:
            return 0.0
        return float("inf") if self.paused else ahead / 1000 / self.rate

    def seek(self, position: float, now: float) -> None:
        """Go on from `position`, ms."""
        self._at, self._since = position, now

    def toggle(self, now: float) -> None:
        """Pause, or go on."""
        self.seek(self.position(now), now)
        self.paused = not self.paused

    def step(self, length: float, now: float) -> None:
        """Pause, `length` ms further on."""
        self.seek(self.position(now) + length, now)
        self.paused = True

    def fall_behind(self, position: float, slack: float, now: float) -> None:
        """Go on from `position` if that is late by more than `slack` s, unless paused."""
        if not self.paused and self.position(now) - position > 1000 * self.rate * slack:
            self.seek(position, now)
