"""The view of a walk: a process beside those of the team, for which nobody waits."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.shared.printable import printable_line
from quadriga.team.launch import QUADRIGA
from quadriga.team.run_folder import CONFIG
from quadriga.view.port import url_of

_GRACE: Final = 5.0  # s to leave once the walk is over


@contextmanager
def view_beside(run_dir: Path, port: int | None, console: Console) -> Iterator[None]:
    """Show a walk in the browser while the context lasts; None: do not.

    A view that fails is told of and changes nothing about the walk.

    Args:
        run_dir: the walk's folder, with its configuration; its log gets there, too.
        port: of the page.
        console: where to say where it is.
    """
    if port is None:
        yield
        return
    logs = run_dir / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    path = logs / "view.log"
    options = ("--port", str(port), "--config", str(run_dir / CONFIG), "--parent", str(os.getpid()))
    with path.open("wb") as log:
        process = subprocess.Popen(
            [*QUADRIGA, "view", *options],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    console.print(f"view of the walk: {url_of(port)}", markup=False, highlight=False)
    try:
        yield
    finally:
        early = process.poll()
        if early is None:
            end_process(process)
        elif early:
            console.print(_format_failure(early, path), markup=False, highlight=False)


def end_process(process: subprocess.Popen[bytes]) -> None:
    """Ask a process beside the team to leave, and kill it if it does not within 5 s."""
    process.terminate()
    try:
        process.wait(_GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _format_failure(status: int, log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines() or ["it said nothing"]
    how = f"signal {-status}" if status < 0 else f"exit status {status}"
    return printable_line(f"the view ended before the walk, {how}: {lines[-1]} ({log})")
