"""Time: the only module that reads the clock. Everything else is given time or waits here."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime
from time import localtime, strftime
from typing import Final

_EPOCH_NS: Final = time.time_ns() - time.monotonic_ns()  # at the start of this process


def monotonic() -> float:
    """Seconds of a clock that never goes back; only differences mean anything."""
    return time.monotonic()


def monotonic_ns() -> int:
    """Nanoseconds of the clock of `monotonic`."""
    return time.monotonic_ns()


def thread_ns() -> int:
    """Nanoseconds of processor time that this thread has had; only differences mean anything."""
    return time.thread_time_ns()


def wall_ns() -> int:
    """Nanoseconds since 1970 of the system clock, which somebody may set at any time."""
    return time.time_ns()


def wall_offset_ns() -> int:
    """The system clock minus the monotonic one; of three readings the least interrupted counts.

    On Linux it changes only when somebody sets the system clock: what PTP or NTP does to its rate
    both clocks follow.
    """
    readings = list[tuple[int, int]]()
    for _ in range(3):
        before, wall, after = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
        readings.append((after - before, wall - (before + after) // 2))
    return min(readings)[1]


def format_local(form: str, ns: int) -> str:
    """A time of `wall_ns` in the user's time zone, whatever TZ says, in a form of `strftime`."""
    return strftime(form, localtime(ns // 1_000_000_000))


def log_ns() -> int:
    """Nanoseconds since 1970 for log times, by the wall clock as it was when this process began.

    Who sets the wall clock during a walk moves none of them.
    """
    return _EPOCH_NS + time.monotonic_ns()


def sleep(seconds: float) -> None:
    """Sleep; a signal handler may run meanwhile."""
    time.sleep(max(seconds, 0.0))


class Rate:
    """Paces a loop: turn k starts at `start + k · period`, and late turns are counted.

    A turn that is more than `slack` periods late moves the schedule instead of being caught up,
    so that a loop that was frozen does not race afterwards.

    Attributes:
        overruns: turns that began late by more than one period.
        lost: by how much the schedule has been moved in all, s.
    """

    def __init__(
        self,
        period: float,
        now: Callable[[], float] = monotonic,
        pause: Callable[[float], None] = sleep,
        slack: float = 20.0,
    ) -> None:
        self._period, self._now, self._pause, self._slack = period, now, pause, slack
        self._next = self._begun = now()
        self.overruns, self.lost = 0, 0.0

    def wait_within(self, share: float) -> None:
        """Wait until a share of a period has passed since the present turn began."""
        self._pause(self._begun + share * self._period - self._now())

    def wait(self) -> float:
        """Wait for the next turn and return how late it begins, in seconds."""
        self._next += self._period
        ahead = self._next - self._now()
        if ahead > 0.0:
            self._pause(ahead)
        self._begun = self._now()
        late = max(self._begun - self._next, 0.0)
        self.overruns += late > self._period
        if late > self._slack * self._period:
            self.lost += late
            self._next = self._begun
        return late


def utc_now() -> datetime:
    """The time by which certificates are made and judged here."""
    return datetime.fromtimestamp(1e-9 * wall_ns(), UTC)
