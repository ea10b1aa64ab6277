"""SHELL of a doctor that stays: looks at a team again and again, and writes down who is healthy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from quadriga.doctor.health import WELL, judge_team
from quadriga.shared.bus.diagnostics import processes
from quadriga.shared.bus.discovery import ask, describe_process, view_of
from quadriga.shared.bus.session import POLL, READY, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.members import DOCTOR, has_lead
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.signals import stop_on_signals

EVERY: Final = 5.0  # s between two looks, each of which costs every process an answer
_OVER: Final = 1.0  # s without who drives time after which the walk is over
_LOST: Final = 15.0  # s without a link after which nobody is waited for: a router may come back


def watch_team(config: Config, folder: Path, stopped: Callable[[], bool] | None = None) -> None:
    """Write a file for each process of a team, until its walk is over or this is stopped.

    The file `<folder>/<name>` says in one line whether the process is healthy, or why not. It is
    written anew at each look, so one that is old says nothing. At the end all are removed.

    Args:
        config: the team's configuration.
        folder: an existing folder.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.

    Raises:
        ConfigError: the folder cannot be written to.
        BusError: the bus cannot be opened.
    """
    stopped, files = stopped or stop_on_signals(), set[Path]()

    def write(found: Mapping[str, str]) -> None:
        """Write down what was found, by name."""
        expected = "an existing folder that can be written to"
        with name_file_errors(ConfigError, f"--watch {folder}", expected):
            for name, line in found.items():
                write_text(folder / name, f"{line}\n")
                files.add(folder / name)

    write({DOCTOR: WELL})
    try:
        with Bus.open(config.bus, config.team.name, DOCTOR, stopped) as bus:
            me, team, end = describe_process(config, DOCTOR), processes(config), WalkEnd(bus)
            while not (stopped() or end.is_over()):
                due = monotonic() + EVERY
                write(judge_team(team, view_of(bus, config, ask(bus), me)))
                while monotonic() < due and not (stopped() or end.is_over()):
                    sleep(POLL)
    finally:
        for file in files:
            file.unlink(missing_ok=True)


class WalkEnd:
    """Whether a walk that was seen is over, or nobody can be seen any more."""

    def __init__(self, bus: Bus) -> None:
        """Begin before the walk."""
        self._bus, self._walks = bus, False
        self._seen = self._unlinked = monotonic()  # who drives time, and no link, for the last time

    def is_over(self) -> bool:
        """Whether to wait no longer; asked often."""
        now, linked = monotonic(), self._bus.linked
        if has_lead(self._bus.members_at(READY)):
            self._walks, self._seen = True, now
        elif linked and not self._walks:
            self._seen = now
        if not linked:
            self._unlinked = now
            return now - self._seen > _LOST
        # Who is there is seen some moments after a link has come back.
        return now - max(self._seen, self._unlinked) > _OVER
