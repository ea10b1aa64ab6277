"""A module that runs by clocks that go wrong: `python -m quadriga.faults.skewed FILE MODULE …`.

The file holds two numbers: by how much the wall clock is ahead, s, and by what share both clocks
run fast. It is read at the start and at each signal SIGUSR1. What this project reads of the clocks
is changed, in this process alone; those of the system and of Zenoh's own threads stay as they are.
"""

from __future__ import annotations

import runpy
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, Final

from quadriga.shared.runtime import clock

_NS: Final = 1_000_000_000


class SkewedTime:
    """In place of the module `time`, as far as `quadriga.shared.runtime.clock` asks it.

    Args:
        monotonic_ns, time_ns, sleep, thread_time_ns: those of the true clocks; the last one stays
            true, as what was computed depends on no clock.
    """

    def __init__(
        self,
        monotonic_ns: Callable[[], int],
        time_ns: Callable[[], int],
        sleep: Callable[[float], None],
        thread_time_ns: Callable[[], int],
    ) -> None:
        self._monotonic_ns, self._time_ns, self._sleep = monotonic_ns, time_ns, sleep
        self.thread_time_ns = thread_time_ns
        self._step_ns, self._rate = 0, 0.0
        self._gained_ns, self._since = 0, monotonic_ns()

    def set(self, step_s: float, rate: float) -> None:
        """From now on the wall clock is ahead by `step_s`, and both run fast by a share `rate`."""
        self._gained_ns, self._since = self._gained(), self._monotonic_ns()
        self._step_ns, self._rate = round(_NS * step_s), rate

    def monotonic_ns(self) -> int:
        return self._monotonic_ns() + self._gained()

    def monotonic(self) -> float:
        return self.monotonic_ns() / _NS

    def time_ns(self) -> int:
        return self._time_ns() + self._gained() + self._step_ns

    def sleep(self, seconds: float) -> None:
        self._sleep(seconds / (1.0 + self._rate))

    def _gained(self) -> int:
        return self._gained_ns + round(self._rate * (self._monotonic_ns() - self._since))


def main() -> None:
    """Run the module with its arguments, by clocks that go wrong."""
    file, module, *words = sys.argv[1:]
    names = vars(clock)
    true: Any = names["time"]
    skewed = names["time"] = SkewedTime(
        true.monotonic_ns, true.time_ns, true.sleep, true.thread_time_ns
    )

    def read(_number: int = 0, _frame: FrameType | None = None) -> None:
        step_s, rate = Path(file).read_text(encoding="ascii").split()
        skewed.set(float(step_s), float(rate))

    read()
    signal.signal(signal.SIGUSR1, read)
    sys.argv = [module, *words]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
