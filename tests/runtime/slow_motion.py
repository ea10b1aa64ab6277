"""A module that runs in slow motion: `python -m tests.runtime.slow_motion SPEED MODULE …`.

Robots fall, and rightly, where a computer is too slow for their team in real time. Slow motion
leaves such a computer time for each tick: all clocks that this project reads run at a share `SPEED`
of their speed, in all processes from the same origin. Those of Zenoh's own threads are as ever.
"""

from __future__ import annotations

import runpy
import sys
import time

from quadriga.shared.runtime import clock


class SlowTime:
    """In place of the module `time`, as far as `quadriga.shared.runtime.clock` asks it."""

    def __init__(self, speed: float) -> None:
        self._speed = speed

    def monotonic_ns(self) -> int:
        return round(self._speed * time.monotonic_ns())

    def monotonic(self) -> float:
        return 1e-9 * self.monotonic_ns()

    def time_ns(self) -> int:
        return time.time_ns() - time.monotonic_ns() + self.monotonic_ns()

    def thread_time_ns(self) -> int:
        return round(self._speed * time.thread_time_ns())

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds / self._speed)


if __name__ == "__main__":
    vars(clock)["time"] = SlowTime(float(sys.argv[1]))
    sys.argv = sys.argv[2:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
