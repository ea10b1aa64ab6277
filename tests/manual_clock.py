"""A clock that moves when it is told to."""

from __future__ import annotations


class ManualClock:
    """It moves when it is told to, and when somebody sleeps on it."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        """The present reading in seconds."""
        return self.now

    def sleep(self, seconds: float) -> None:
        """Move on by `seconds`."""
        self.now += max(seconds, 0.0)
