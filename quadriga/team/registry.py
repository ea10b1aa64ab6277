"""SHELL: teams that run on this machine leave files by which others of its user find them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.places import make_runtime_dir, runtime_dir
from quadriga.shared.runtime.process_use import read_use

_SUFFIX: Final = ".json"
_SHOWN: Final = 6  # of many teams, in an error
_LONGEST: Final = 200  # characters of one's name or file there


@dataclass(frozen=True, slots=True)
class RunningTeam:
    """What a process of a team leaves for others of this machine to find.

    Attributes:
        team: its name.
        endpoint: where its bus is.
        config: path of the configuration in force, a TOML file.
        folder: its run folder; "" if there is none.
        directory: that its processes were started in; paths in the configuration begin there.
        pid: of the process that says so.
        started: when that process was started, see `ProcessUse`.
    """

    team: str
    endpoint: str
    config: str
    folder: str
    directory: str
    pid: int
    started: int


@contextmanager
def team_registered(config: Config, run_dir: Path | None = None) -> Iterator[None]:
    """Within the block others of this user find the team of this process.

    Where no file can be left nobody finds it, and nothing else is different.

    Args:
        config: the configuration in force.
        run_dir: holds it as `config.toml`; None: a copy is left beside the file.
    """
    pid, use = os.getpid(), read_use(os.getpid())
    entry = runtime_dir() / f"{pid}{_SUFFIX}"
    copy = entry.with_suffix(".toml")
    try:
        if use is not None and make_runtime_dir() is not None:
            with suppress(OSError):
                folder = "" if run_dir is None else str(run_dir.resolve())
                if run_dir is None:
                    write_text(copy, to_toml(config))
                file = f"{folder}/config.toml" if folder else str(copy)
                place = config.team.name, config.bus.endpoint, file, folder, os.getcwd()
                team = asdict(RunningTeam(*place, pid, use.started))
                write_text(entry, json.dumps(team, ensure_ascii=False))
        yield
    finally:
        for path in (entry, copy):
            with suppress(OSError):
                path.unlink(missing_ok=True)


def running_teams() -> tuple[RunningTeam, ...]:
    """The teams of this user that run on this machine now, the oldest first.

    Files of processes that have ended are removed. Those of other users are not looked at: the
    folder is this user's alone, or none.
    """
    folder = make_runtime_dir()
    found = []
    for file in () if folder is None else sorted(folder.glob(f"*{_SUFFIX}")):
        with suppress(OSError, ValueError, TypeError):  # it is gone, or none of this version
            team = RunningTeam(**json.loads(file.read_text(encoding="utf-8")))
            use = read_use(team.pid)
            if use is not None and use.started == team.started:
                found.append(team)
                continue
            for path in (file, file.with_suffix(".toml")):
                path.unlink(missing_ok=True)
    return unite_teams(found)


def unite_teams(found: Iterable[RunningTeam]) -> tuple[RunningTeam, ...]:
    """Each team once: what several of its processes say, with a run folder if one has it."""
    united: dict[tuple[str, str], RunningTeam] = {}
    for team in sorted(found, key=lambda team: (not team.folder, team.started)):
        united.setdefault((team.team, team.endpoint), team)
    return tuple(sorted(united.values(), key=lambda team: (team.started, team.pid)))


def choose_team(teams: Sequence[RunningTeam], wanted: str = "") -> RunningTeam | None:
    """The team that a user means; None if none of these is.

    Args:
        teams: those that run on this machine.
        wanted: name of the one meant; "": the only one.

    Raises:
        ConfigError: several are meant.
    """
    meant = [team for team in teams if not wanted or team.team == wanted]
    if len(meant) < 2:
        return meant[0] if meant else None
    by_name = len({team.team for team in meant}) == len(meant)
    choices = [f"--team {t.team}" if by_name else f"--config {t.config}" for t in meant[:_SHOWN]]
    choices = [choice[:_LONGEST] for choice in choices]
    more = [f"and {len(meant) - _SHOWN} more"] if len(meant) > _SHOWN else []
    got = f"{len(meant)} that run on this machine"
    raise ConfigError("team", got, "the choice of one", "; ".join([*choices, *more]))
