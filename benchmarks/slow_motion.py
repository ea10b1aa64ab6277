"""A module that runs in slow motion: `python -m benchmarks.slow_motion SPEED MODULE …`.

Robots fall, and rightly, where a computer is too slow for their team in real time. Slow motion
leaves such a computer time for each tick: all clocks that this project reads run at a share `SPEED`
of their speed, in all processes from the same origin. Those of Zenoh's own threads are as ever.
"""

from __future__ import annotations

import argparse
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
    """The same process by slow clocks.

    Args:
        row: of the launcher's table; it runs a module.
        speed: of the clocks, as a share of their own, at most 1.
    """
    module = row.command.index("-m") + 1  # without -P: this module lies in the working directory
    words = (row.command[0], "-m", __name__, str(speed), *row.command[module:])
    return replace(row, command=words)


def read_speed(text: str) -> float:
    """The speed of a command line.

    Raises:
        argparse.ArgumentTypeError: it is no share above 0 and at most 1.
    """
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.0 < speed <= 1.0:
        raise argparse.ArgumentTypeError(f"got {text}, expected a share above 0 and at most 1")
    return speed


def main() -> None:
    """Run the module with its arguments, by slow clocks."""
    speed, module, *words = sys.argv[1:]
    vars(clock)["time"] = SlowTime(float(speed))
    sys.argv = [module, *words]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
