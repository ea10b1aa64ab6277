"""The line a user watches while trials are walked: done, fallen, time left."""

from __future__ import annotations

from typing import Final, Self

from rich.console import Console
from rich.progress import TaskID

from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.progress import build_progress
from quadriga.shared.runtime.clock import monotonic

_LINE_PERIOD: Final = 60.0  # s, between lines where there is no terminal to draw a bar on


class TrialProgress:
    """A bar on a terminal, else a line now and then; a context that must be entered.

    Args:
        console: where to show it.
        total: trials in all.
        kept: of these, trials that had been walked before.
    """

    def __init__(self, console: Console, total: int, kept: int) -> None:
        self._console, self._total, self._kept = console, total, kept
        self._done = self._fell = 0
        self._begin = self._last_line = monotonic()
        count = "{task.completed}/{task.total} trials{task.fields[text]}"
        self._bar = build_progress(console, count, elapsed=True)
        self._task: TaskID = self._bar.add_task("walking", total=total, completed=kept, text="")

    def advance(self, row: TrialOutcome) -> None:
        """One more is done."""
        self._done += 1
        self._fell += row.fell
        now = monotonic()
        left = (self._total - self._kept - self._done) * (now - self._begin) / self._done
        text = f", {self._fell} fell, {format_duration(left)} left"
        self._bar.update(self._task, completed=self._kept + self._done, text=text)
        if not self._console.is_terminal and now - self._last_line >= _LINE_PERIOD:
            self._last_line = now
            self._print(f"{self._kept + self._done}/{self._total} trials{text}")

    def __enter__(self) -> Self:
        if self._kept:
            self._print(f"{self._kept} of {self._total} trials are walked already")
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
        if self._done:
            took = format_duration(monotonic() - self._begin)
            self._print(f"{self._done} trials in {took}, {self._fell} of them with a fall")

    def _print(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False)


def format_duration(seconds: float) -> str:
    """A time for people: `42 s`, `7 min`, `3 h 05 min`."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"
