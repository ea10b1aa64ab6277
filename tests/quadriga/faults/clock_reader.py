"""Tells the wall clock twice; in between `quadriga.faults.skewed` sets it right."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from quadriga.shared.runtime.clock import wall_ns

if __name__ == "__main__":
    print(wall_ns())
    Path(sys.argv[1]).write_text("0 0", encoding="ascii")
    os.kill(os.getpid(), signal.SIGUSR1)
    print(wall_ns())
