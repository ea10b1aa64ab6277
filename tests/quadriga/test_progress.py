"""A bar is for a terminal; without one it is silent, or its last state is one line."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from quadriga.progress import build_progress


@pytest.mark.parametrize(
    ("terminal", "hidden", "shown"),
    [(True, True, True), (False, True, False), (False, False, True)],
)
def test_who_sees_a_bar(terminal: bool, hidden: bool, shown: bool) -> None:
    text = io.StringIO()
    console = Console(file=text, force_terminal=terminal, width=80)
    with build_progress(console, "{task.completed}/{task.total} eggs", hidden=hidden) as bar:
        bar.update(bar.add_task("counting", total=3), completed=2)
    assert ("counting" in text.getvalue()) == shown
    assert ("2/3 eggs" in text.getvalue()) == shown
