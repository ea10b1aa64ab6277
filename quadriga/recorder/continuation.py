"""A recorder that is started again writes a file of its own beside that of the one before."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

_SECOND: Final = 2  # run.mcap is followed by run.2.mcap


def choose_path(
    path: Path, team_walks: Callable[[], bool], say: Callable[[str], None]
) -> tuple[Path, Path | None]:
    """The file to write, and the one that it continues.

    Args:
        path: the file that is asked for.
        team_walks: whether the team does; asked only if the file exists.
        say: called with what a user should know at once.

    Returns:
        `path` itself unless it exists and the team walks. Nobody overwrites it then either: who
        creates it complains.
    """
    if not path.exists() or not team_walks():
        return path, None
    before, number = path, _SECOND
    while (following := path.with_name(f"{path.stem}.{number}{path.suffix}")).exists():
        before, number = following, number + 1
    say(f"{path.name} is there already: this recording goes on in {following.name}")
    return following, before
