"""Operators that listen on this machine, for programs of the same user."""

from __future__ import annotations

from pathlib import Path

from quadriga.drive.client import SUFFIX, ControlLink
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.places import make_runtime_dir


def find_operators(team: str = "") -> list[Path]:
    """The sockets of operators, of one team or of all; some may have been left by a crash."""
    folder = make_runtime_dir()
    if folder is None:
        return []
    return sorted(folder.glob(f"{team or '*'}-*{SUFFIX}"))


def open_link(team: str = "") -> ControlLink:
    """A connection to the operator of a team, or of the only one.

    Raises:
        ConfigError: none listens on this machine, or several do.
    """
    links, names = list[ControlLink](), list[str]()
    for path in find_operators(team):
        try:
            links.append(ControlLink(path))
            names.append(path.name.rpartition("-")[0])
        except OSError:
            continue  # left behind
    if len(links) == 1:
        return links[0]
    for link in links:
        link.close()
    if links:
        choice = f"one of {', '.join(sorted(set(names)))}, by --team"
        raise ConfigError("team", f"{len(links)} that run on this machine", choice)
    what = f"team {team!r}" if team else "team"
    raise ConfigError(what, "no operator on this machine", "one", "quadriga walk --drive")
