"""What the system tells of a process on this machine: since when it runs, what it takes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple


class ProcessUse(NamedTuple):
    """What a process has taken so far."""

    # When it was started, in clock ticks since the system was; with the process id it names a
    # process for good, since ids are given again.
    started: int
    cpu_s: float  # of processor time, s
    memory: int  # that it holds, bytes


def read_use(pid: int) -> ProcessUse | None:
    """What a process of this machine has taken; None if there is none of this number."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:  # it has ended, or /proc is not there
        return None
    fields = text.rpartition(")")[2].split()  # behind the name, see proc_pid_stat(5)
    user, system, started, pages = (int(fields[place]) for place in (11, 12, 19, 21))
    cpu_s = (user + system) / os.sysconf("SC_CLK_TCK")
    return ProcessUse(started, cpu_s, pages * os.sysconf("SC_PAGE_SIZE"))
