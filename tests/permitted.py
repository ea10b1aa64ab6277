"""Whether this user may schedule processes in real time."""

from __future__ import annotations

import subprocess
import sys

_PROBE = "import os; os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))"


def permitted() -> bool:
    """Whether a process of this user could be scheduled so: one tries, and ends."""
    command = [sys.executable, "-c", _PROBE]
    return not subprocess.run(command, capture_output=True, check=False).returncode
