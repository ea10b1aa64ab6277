"""SHELL: teams that run on this machine leave files by which others of its user find them."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.runtime.places import is_private, make_runtime_dir, runtime_dir
from quadriga.shared.runtime.process_use import read_use
from quadriga.team.running_team import RunningTeam, read_running_team, to_json, unite_teams

_SUFFIX: Final = ".json"
_LONGEST: Final = 65_536  # bytes that are read of a file


@contextmanager
def team_registered(config: Config, run_dir: Path | None = None) -> Iterator[None]:
    """Within the block others of this user find the team of this process.

    Where no file can be left nobody finds it, and nothing else is different.

    Args:
        config: the configuration in force.
        run_dir: holds it as `config.toml`; None: a copy is left beside the file.
    """
    pid = os.getpid()
    entry = runtime_dir() / f"{pid}{_SUFFIX}"
    copy = entry.with_suffix(".toml")
    try:
        _leave(entry, copy, config, run_dir, pid)
        yield
    finally:
        for path in (entry, copy):
            with suppress(OSError):
                path.unlink(missing_ok=True)


def _leave(entry: Path, copy: Path, config: Config, run_dir: Path | None, pid: int) -> None:
    use = read_use(pid)
    if use is None or make_runtime_dir() is None:
        return
    with suppress(OSError):
        folder = "" if run_dir is None else str(run_dir.resolve())
        if run_dir is None:
            _write(copy, to_toml(config))
        file = str(copy if run_dir is None else run_dir.resolve() / "config.toml")
        bus, name = config.bus, config.team.name
        team = RunningTeam(name, bus.endpoint, file, folder, os.getcwd(), pid, use.started)
        _write(entry, to_json(team))


def running_teams() -> tuple[RunningTeam, ...]:
    """The teams of this user that run on this machine now, the oldest first.

    Files of processes that have ended are removed; those of other users are not looked at.
    """
    folder = make_runtime_dir()
    if folder is None:
        return ()
    found = []
    for file in sorted(folder.glob(f"*{_SUFFIX}")):
        team = _read(file)
        if team is None:
            continue
        use = read_use(team.pid)
        if use is not None and use.started == team.started:
            found.append(team)
        else:
            for path in (file, file.with_suffix(".toml")):
                with suppress(OSError):
                    path.unlink(missing_ok=True)
    return unite_teams(found)


def _read(file: Path) -> RunningTeam | None:
    """What a file of this user tells; None if it is somebody else's, or tells nothing."""
    try:
        with open(os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as opened:
            about = os.fstat(opened.fileno())
            if not stat.S_ISREG(about.st_mode) or not is_private(about):
                return None
            return read_running_team(opened.read(_LONGEST).decode("utf-8", errors="replace"))
    except OSError:
        return None


def _write(path: Path, text: str) -> None:
    """Write a file that is there whole or not at all, for this user alone."""
    partial = path.with_name(f".{path.name}.partial")
    partial.unlink(missing_ok=True)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
    with open(os.open(partial, flags, 0o600), "w", encoding="utf-8") as file:
        file.write(text)
    partial.replace(path)
