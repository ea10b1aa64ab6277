"""Operators that listen on this machine, for programs of the same user."""

from __future__ import annotations

from quadriga.drive.client import PATIENCE, SUFFIX, ControlLink
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.places import make_runtime_dir


def open_links(team: str = "", patience: float = PATIENCE) -> list[ControlLink]:
    """Connections to the operators of one team, or of all, by the names of their sockets.

    A socket that a crash has left behind is removed.

    Args:
        team: its name; "": all.
        patience: longest wait for an answer, s.
    """
    folder, links = make_runtime_dir(), list[ControlLink]()
    for path in sorted(folder.glob(f"*-*{SUFFIX}")) if folder is not None else ():
        if not team or path.name.rpartition("-")[0] == team:
            try:
                links.append(ControlLink(path, patience))
            except ConnectionRefusedError:
                path.unlink(missing_ok=True)
            except OSError:
                continue
    return links


def open_link(team: str = "") -> ControlLink:
    """A connection to the operator of a team, or of the only one.

    Raises:
        ConfigError: none listens on this machine, or several do.
    """
    links = open_links(team)
    if len(links) == 1:
        return links[0]
    for link in links:
        link.close()
    if links:
        choice = f"one of {', '.join(sorted({link.team for link in links}))}, by --team"
        raise ConfigError("team", f"{len(links)} that run on this machine", choice)
    what = f"team {team!r}" if team else "team"
    raise ConfigError(what, "no operator on this machine", "one", "quadriga walk --drive")
