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
LATE: Final = "late"
HELD: Final = "held"


class Deadlines:
    """Counts from the first tick on."""

    def __init__(self, names: Iterable[str]) -> None:
        self._counts: Counter[str] = Counter()
        self._ages = {name: Histogram(1.0) for name in names}
        self._jitter = Histogram(0.02)
        self._lateness_us: list[float] = []

    def note_command(self, robot: str, age_ms: int, *, held: bool = False) -> None:
        """A tick was taken with a command of this age, or with joints `held` in its place."""
        self._ages[robot].add(age_ms)
        self._counts.update({f"{robot}.{DUE}": 1, f"{robot}.{LATE}": age_ms > 0})
        self._counts[f"{robot}.{HELD}"] += held

    def note_lateness(self, late_s: float) -> None:
        """The world went on this much later than its clock says."""
        self._jitter.add(1e3 * late_s)
        self._lateness_us.append(1e6 * late_s)

    def describe_late(self) -> str:
        """For each robot the numbers of ticks whose command was late, and of those held."""
        return ", ".join(
            f"{name} {self._counts[f'{name}.{LATE}']} held {self._counts[f'{name}.{HELD}']}"
            for name in self._ages
        )

    def status(self, tick: int, overruns: int) -> Status:
        """The report, as sent on `<team>/sim/status`.

        `ages_ms` holds median, p99 and max of `<robot>.command` and of the world's own `jitter`;
        counters are `<robot>.due` (ticks at which it takes a command), `.late` (without the command
        of that tick), `.held` (at which the motors held the joints), `ticks` and `overruns`;
        `tick_us` holds the lateness of each tick since the last status.
        """
        ages = self._jitter.quantiles("jitter")
        for robot, histogram in self._ages.items():
            ages |= histogram.quantiles(f"{robot}.command")
        counters = {"overruns": overruns, "ticks": tick, **self._counts}
        lateness, self._lateness_us = np.array(self._lateness_us), []
        return Status(tick, tick * 1_000_000, MODE, "", "", ages, counters, np.zeros(0), lateness)
