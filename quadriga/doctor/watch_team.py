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
    stopped, files = stopped or stop_on_signals(), HealthFiles(folder)
    files.write({DOCTOR: WELL})
    try:
        with Bus.open(config.bus, config.team.name, DOCTOR, stopped) as bus:
            _watch(bus, config, files, stopped)
    finally:
        files.remove()


def _watch(bus: Bus, config: Config, files: HealthFiles, stopped: Callable[[], bool]) -> None:
    me, team = describe_process(config, DOCTOR), processes(config)
    end = WalkEnd(bus)
    while not (stopped() or end.is_over()):
        due = monotonic() + EVERY
        view = view_of(bus, config, ask(bus), me)
        files.write(judge_team(team, view))
        while monotonic() < due and not (stopped() or end.is_over()):
            sleep(POLL)


class HealthFiles:
    """A file for each process, there whole or not at all; none need outlive a crash."""

    def __init__(self, folder: Path) -> None:
        """Begin with none of them."""
        self._folder, self._written = folder, set[Path]()

    def write(self, found: Mapping[str, str]) -> None:
        """Write down what was found, by name.

        Raises:
            ConfigError: the folder cannot be written to.
        """
        expected = "an existing folder that can be written to"
        with name_file_errors(ConfigError, f"--watch {self._folder}", expected):
            for name, line in found.items():
                path = self._folder / name
                write_text(path, f"{line}\n")
                self._written.add(path)

    def remove(self) -> None:
        """Remove all of them."""
        for path in self._written:
            path.unlink(missing_ok=True)


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
