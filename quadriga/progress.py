"""The bar that a user watches while something takes long."""

from __future__ import annotations

import io

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn


def quiet_console() -> Console:
    """A console that shows nothing, and leaves alone what the caller prints meanwhile.

    On a terminal, or in a notebook, a bar would take over the standard output while it is shown.
    """
    return Console(file=io.StringIO(), quiet=True, force_terminal=False, force_jupyter=False)


def build_progress(
    console: Console,
    count: str = "",
    *,
    elapsed: bool = False,
    fleeting: bool = False,
    hidden: bool = True,
) -> Progress:
    """A bar behind each task's description.

    Args:
        console: where to show it.
        count: what stands behind the bar, in Rich's fields: `{task.completed}/{task.total}`.
        elapsed: show the time since the beginning.
        fleeting: nothing of the bar stays at its end.
        hidden: without a terminal nothing is shown, instead of the last state.
    """
    columns: list[ProgressColumn] = [TextColumn("{task.description}"), BarColumn()]
    if count:
        columns.append(TextColumn(count))
    if elapsed:
        columns.append(TimeElapsedColumn())
    return Progress(
        *columns, console=console, transient=fleeting, disable=hidden and not console.is_terminal
    )
