"""SHELL: tells who has started a walk where it is driven from."""

from __future__ import annotations

from contextlib import suppress

from rich.console import Console

from quadriga.drive.client import ControlLink, socket_path
from quadriga.drive.driver_words import WHERE
from quadriga.shared.config.sections import BY_HAND, Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.places import runtime_dir


class DrivePage:
    """The page of a team that is driven by hand, once its operator has one.

    Args:
        config: the team's configuration.
        pid: of its operator.
        console: where to tell it.
    """

    def __init__(self, config: Config, pid: int, console: Console) -> None:
        self._path = socket_path(runtime_dir(), config.team.name, pid)
        self._console = console
        self._waits = config.reference.driver == BY_HAND

    def tell_once(self) -> None:
        """Tell it as soon as it is known."""
        if not (self._waits and self._path.exists()):
            return
        with suppress(OSError, BusError), ControlLink(self._path) as link:
            page, _, token = str(link.ask(WHERE).get("url")).partition("?")
            # The token drives the team: it goes to no file.
            rest = (
                f"?{token}" if self._console.is_terminal else "; `quadriga drive` tells its token"
            )
            self._console.print(f"drive from {page}{rest}", markup=False, soft_wrap=True)
            self._waits = False
