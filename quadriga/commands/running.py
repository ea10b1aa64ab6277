"""Which team a command of another terminal means: the one that runs on this machine."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from quadriga.commands.command import say
from quadriga.shared.config.sections import Config
from quadriga.shared.members import ROLES

if TYPE_CHECKING:
    from quadriga.team.registry import RunningTeam

# Commands for a team that runs already.
_LIVE: Final = frozenset(
    ("estop", "stop", "resume", "reset", "echo", "record", "doctor", "status", "view")
)
_LIVE_IF: Final = {"fault": "live"}  # by the option that asks for it
# With one of these nothing is asked of a team: `echo --file`, `doctor --here`, `view RUN`.
_ELSEWHERE: Final = ("file", "here", "recording")
_MEMBERS: Final = frozenset((*(role.command for role in ROLES), "bridge"))
# Whoever gives one of these says where the team is; the name alone chooses among several.
_PLACES: Final = ("bus.endpoint", "bus.mode")
_NAME: Final = "team.name"


def find_running(arguments: argparse.Namespace, overrides: Mapping[str, Any]) -> RunningTeam | None:
    """The team that runs on this machine, if the command is for one and no other place is given.

    Args:
        arguments: the command's options.
        overrides: by `section.key` what single options set.

    Raises:
        ConfigError: several run, and none is chosen.
    """
    if not _asks_for_one(arguments) or any(name in overrides for name in _PLACES):
        return None
    from quadriga.team.registry import choose_team, running_teams

    found = choose_team(running_teams(), str(overrides.get(_NAME, "")))
    if found is not None:
        say(f"team {found.team!r} of {found.folder or f'process {found.pid}'}")
    return found


def _asks_for_one(arguments: argparse.Namespace) -> bool:
    command, given = arguments.command, vars(arguments)
    switch = _LIVE_IF.get(command, "")
    live = command in _LIVE or bool(given.get(switch))
    named = arguments.parent or arguments.config is not None or arguments.scenario is not None
    return live and not named and not any(given.get(name) for name in _ELSEWHERE)


def at_its_place(team: RunningTeam, given: dict[str, Any]) -> dict[str, Any]:
    """What its configuration gives, with certificates where its processes have them."""
    bus = {**given.get("bus", {})}
    folder = bus.get("certificates", Config().bus.certificates)
    return {**given, "bus": bus | {"certificates": str(Path(team.directory) / folder)}}


@contextmanager
def registered(arguments: argparse.Namespace, config: Config) -> Iterator[None]:
    """Within the block others find the team of a member that was started by hand."""
    started_by_hand = arguments.command in _MEMBERS and not arguments.parent
    if not started_by_hand or vars(arguments).get("emulated"):  # who speaks a robot's protocol
        yield
        return
    from quadriga.team.registry import team_registered

    with team_registered(config):
        yield
