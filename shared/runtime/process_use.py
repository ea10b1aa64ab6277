"""What the system tells of a process on this machine: since when it runs, what it takes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_PROC: Final = Path("/proc")
# Fields of /proc/PID/stat behind the name, which is in brackets: see proc_pid_stat(5).
_UTIME, _STIME, _START, _RSS = 11, 12, 19, 21


@dataclass(frozen=True, slots=True)
class ProcessUse:
    """What a process has taken so far.

    Attributes:
        started: when it was started, in clock ticks since the system was; with the process id it
            names a process for good, since ids are given again.
        cpu_s: of processor time, s.
        memory: that it holds, bytes.
    """

    started: int
    cpu_s: float
    memory: int


def read_use(pid: int) -> ProcessUse | None:
    """What a process of this machine has taken; None if there is none of this number."""
    try:
        text = (_PROC / str(pid) / "stat").read_text(encoding="ascii", errors="replace")
        fields = text.rpartition(")")[2].split()
        ticks = int(fields[_UTIME]) + int(fields[_STIME])
        memory = int(fields[_RSS]) * os.sysconf("SC_PAGE_SIZE")
        return ProcessUse(int(fields[_START]), ticks / os.sysconf("SC_CLK_TCK"), memory)
    except (OSError, ValueError, IndexError):  # it has ended, or /proc is not there
        return None
