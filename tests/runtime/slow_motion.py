"""A module that runs in slow motion: `python -m tests.runtime.slow_motion SPEED MODULE …`.

Robots fall, and rightly, where a computer is too slow for their team in real time. Slow motion
leaves such a computer time for each tick: all clocks that this project reads run at a share `SPEED`
of their speed, in all processes from the same origin. Those of Zenoh's own threads are as ever.
"""

from __future__ import annotations

import runpy
import sys
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from quadriga.shared.runtime import clock

if TYPE_CHECKING:
    from quadriga.team.launch import ProcessSpec  # a process that runs so need not load it

_NS: Final = 1_000_000_000


class SlowTime:
    """In place of the module `time`, as far as `quadriga.shared.runtime.clock` asks it."""

    def __init__(self, speed: float) -> None:
        self._speed = speed

    def monotonic_ns(self) -> int:
        return round(self._speed * time.monotonic_ns())

    def monotonic(self) -> float:
        return self.monotonic_ns() / _NS

    def time_ns(self) -> int:
        return time.time_ns() - time.monotonic_ns() + self.monotonic_ns()

    def thread_time_ns(self) -> int:
        return round(self._speed * time.thread_time_ns())

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds / self._speed)


def in_slow_motion(row: ProcessSpec, speed: float) -> ProcessSpec:
    """The same process of the launcher's table by slow clocks; `speed` is a share, at most 1."""
    module = row.command.index("-m") + 1  # without -P: this module lies in the working directory
    words = (row.command[0], "-m", __name__, str(speed), *row.command[module:])
    return replace(row, command=words)


if __name__ == "__main__":
    vars(clock)["time"] = SlowTime(float(sys.argv[1]))
    sys.argv = sys.argv[2:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
