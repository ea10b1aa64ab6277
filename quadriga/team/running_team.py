"""A team that runs on this machine, and which of several is meant: pure."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Final

from quadriga.shared.errors import ConfigError

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


def to_json(team: RunningTeam) -> str:
    """One JSON object."""
    return json.dumps(asdict(team), ensure_ascii=False)


def read_running_team(text: str) -> RunningTeam | None:
    """The team that a file tells of; None if it is not what `to_json` makes.

    Fields that a later version adds are passed over.
    """
    try:
        body = json.loads(text)
        values = {item.name: body[item.name] for item in fields(RunningTeam)}
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    texts = [values[name] for name in ("team", "endpoint", "config", "folder", "directory")]
    numbers = [values["pid"], values["started"]]
    if not all(isinstance(text, str) and text.isprintable() for text in texts):
        return None
    if not all(type(number) is int and number > 0 for number in numbers):
        return None
    return RunningTeam(**values)


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
    names = {team.team for team in meant}
    by_name = len(names) == len(meant)
    choices = [f"--team {t.team}" if by_name else f"--config {t.config}" for t in meant[:_SHOWN]]
    choices = [choice[:_LONGEST] for choice in choices]
    more = [f"and {len(meant) - _SHOWN} more"] if len(meant) > _SHOWN else []
    got = f"{len(meant)} that run on this machine"
    raise ConfigError("team", got, "the choice of one", "; ".join([*choices, *more]))
