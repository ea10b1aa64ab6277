"""The real-time world's report: the age of the commands that it used, and its own lateness."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Final

import numpy as np

from quadriga.shared.messages import Status
from quadriga.shared.runtime.histogram import Histogram

PERIOD_MS: Final = 1000
MODE: Final = "realtime"
DUE: Final = "due"  # ends the name of a counter, behind a robot's name: see `Deadlines.status`
LATE_COUNT: Final = "late"
LATE: Final = ""
HELD: Final = "held"
_BIN_MS: Final = 0.02


class Deadlines:
    """Counts from the first tick on.

    Attributes:
        late: number of ticks by robot and grade: `LATE` counts every tick without a command of
            that tick, `HELD` those at which the motors held the joints. Of a robot that takes
            commands every other tick, only those count.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self.late: Counter[tuple[str, str]] = Counter()
        self._due: Counter[str] = Counter()
        self._ages = {name: Histogram(1.0) for name in names}
        self._jitter = Histogram(_BIN_MS)
        self._lateness_us: list[float] = []

    def note_age(self, robot: str, age_ms: int) -> None:
        """A tick has been taken with a robot's command of this age."""
        self._ages[robot].add(age_ms)
        self._due[robot] += 1
        self.late[robot, LATE] += age_ms > 0

    def note_lateness(self, late_s: float) -> None:
        """The world went on this much later than its clock says."""
        self._jitter.add(1e3 * late_s)
        self._lateness_us.append(1e6 * late_s)

    def describe_late(self) -> str:
        """The counts of late ticks in words, "none" where no tick has been counted."""
        counts = sorted(self.late.items())
        return ", ".join(f"{' '.join(filter(None, key))} {n}" for key, n in counts) or "none"

    def status(self, tick: int, overruns: int) -> Status:
        """The report, as sent on `<team>/sim/status`.

        `ages_ms` holds median, p99 and max of `<robot>.command` and of the world's own `jitter`;
        counters are `<robot>.due` (ticks at which it takes a command), `.late`, `.held`, `ticks`
        and `overruns`; `tick_us` holds the lateness of each tick since the last status.
        """
        ages: dict[str, float] = self._jitter.quantiles("jitter")
        for robot, histogram in self._ages.items():
            ages |= histogram.quantiles(f"{robot}.command")
        counters = {"overruns": overruns, "ticks": tick}
        counters |= {f"{robot}.{DUE}": count for robot, count in sorted(self._due.items())}
        for (robot, grade), count in sorted(self.late.items()):
            counters[f"{robot}.{grade or LATE_COUNT}"] = count
        lateness, self._lateness_us = np.array(self._lateness_us), []
        return Status(tick, tick * 1_000_000, MODE, "", "", ages, counters, np.zeros(0), lateness)
