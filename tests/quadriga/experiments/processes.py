"""Campaigns as processes of their own, and what they leave behind."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from quadriga.experiments.campaign.ledger import ROWS, read_manifest, read_rows
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.shared.runtime.clock import monotonic, sleep

LONGEST = 300.0  # s; that things happen is tested, not how soon


def start(*words: str, verb: str = "campaign") -> subprocess.Popen[str]:
    """`quadriga campaign`, or another verb, with these words."""
    command = [sys.executable, "-m", "quadriga", verb, *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def finished(folder: Path) -> list[TrialOutcome]:
    """Rows of a folder that may not be there yet."""
    if not (folder / ROWS).exists():
        return []
    return read_rows(folder, read_manifest(folder))


def await_true(what: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait for something that comes while a process runs."""
    deadline = monotonic() + LONGEST
    while not what():
        assert process.poll() is None, process.communicate()[0]
        assert monotonic() < deadline
        sleep(0.02)


def children(pid: int) -> set[int]:
    """Processes that a process has started and that still run, theirs included."""
    found: list[str] = []
    for task in Path(f"/proc/{pid}/task").glob("*"):
        try:
            found += (task / "children").read_text(encoding="ascii").split()
        except OSError:
            continue
    return {int(c) for c in found} | {d for c in found for d in children(int(c))}


def await_gone(pids: Sequence[int] | set[int]) -> None:
    """Wait until none of these processes runs."""
    deadline = monotonic() + LONGEST
    while any(_runs(pid) for pid in pids):
        assert monotonic() < deadline, [pid for pid in pids if _runs(pid)]
        sleep(0.02)


def _runs(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"  # a zombie waits for whoever adopts it
