"""A process that has stood still must not say that the others were silent meanwhile."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

from quadriga.shared.runtime.clock import monotonic, thread_ns

_RECENT: Final = 10.0  # s
_LEAST: Final = 2.0  # s, between two looks without work: far more than a busy computer makes of one


class Standstill:
    """How long a process that looks into its inbox all the time has not run: stopped, or suspended.

    Args:
        clock: s of a clock that never goes back.
        worked: ns of processor time of the thread that looks.

    Attributes:
        total: so long it stood still so far, s.
    """

    def __init__(
        self, clock: Callable[[], float] = monotonic, worked: Callable[[], int] = thread_ns
    ) -> None:
        self.total = self._woke = 0.0
        self._clock, self._worked = clock, worked
        self._last: tuple[float, int] | None = None  # time and work at the last look

    def begin(self) -> None:
        """From now on the process looks all the time."""
        self._last = self._clock(), self._worked()

    def look(self) -> None:
        """Note a look, of a process that has begun; say so if it stood still since the last one."""
        if self._last is None:
            return
        before, worked = self._last
        self.begin()
        idle = self._last[0] - before - 1e-9 * (self._last[1] - worked)
        if idle > _LEAST:
            self.total, self._woke = self.total + idle, self._last[0]
            text = f"this process stood still for {idle:.1f} s: was it, or its computer, suspended?"
            print(f"quadriga: {text}", file=sys.stderr, flush=True)

    @property
    def note(self) -> str:
        """What is to be said for 10 s beside what others seem to have done; "": nothing."""
        recent = self.total and self._clock() - self._woke < _RECENT
        return f"; this process stood still for {self.total:.1f} s" if recent else ""
