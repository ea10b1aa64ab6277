"""SHELL of `quadriga status --watch`: a status again and again, in a terminal or as lines."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Final

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from quadriga.status.format import build_status_tables, format_head, format_rest, format_status
from quadriga.status.listen import TeamListener
from quadriga.status.record import TeamStatus

_HINT: Final = "Ctrl-C leaves; the team goes on"


def show_again_and_again(
    listener: TeamListener, console: Console, stopped: Callable[[], bool], every: float, count: int
) -> None:
    """Show how the team is until its walk is over or `stopped()`.

    Args:
        listener: hears the team.
        console: where to show it: in place in a terminal, else below each other.
        stopped: asked often whether to stop.
        every: seconds between two looks.
        count: how often to show it; 0: until the end.
    """
    shown = 0
    with ExitStack() as stack:
        live = None
        if console.is_terminal:
            screen = Live(console=console, auto_refresh=False, screen=True)
            live = stack.enter_context(screen)
        while not stopped() and not listener.is_over:
            listener.hear(every, stopped)
            if stopped():
                return
            status = listener.look()
            if live is None:
                console.print("\n".join((*format_status(status), "")), markup=False)
            else:
                live.update(build_screen(status, console.width), refresh=True)
            shown += 1
            if shown == count:
                return


def build_screen(status: TeamStatus, width: int) -> Group:
    """What a terminal shows: tables that fit it, and what is wrong in red."""
    parts = [Text(format_head(status), style="bold")]
    tables = [
        part for table in build_status_tables(status) if table.rows for part in table.to_rich(width)
    ]
    rest = [
        Text(line, style="red" if line.startswith("wrong") else "") for line in format_rest(status)
    ]
    return Group(*parts, *tables, *rest, Text(_HINT, style="dim"))
