"""SHELL of a process that hears, before all else, who says that it has stopped, and when.

A recorder on a busy computer notes messages seconds after they were sent, or loses them.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from quadriga.shared.bus.session import Arrival, Bus
from quadriga.shared.config.load import load
from quadriga.shared.members import OBSERVER
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.installed import PYTHON
from quadriga.shared.runtime.scheduling import go_first
from quadriga.shared.runtime.signals import die_with_parent, stop_on_signals
from quadriga.shared.topics import EVENT, STATUS
from quadriga.team.spectator import end_process

_LOOK_S: Final = 0.1


@contextmanager
def stop_listener(config: Path, heard: Path) -> Iterator[None]:
    """Note within the block what a team's agents and plant say of themselves.

    Args:
        config: file with the configuration of the team.
        heard: file to write to, see `read_heard`.
    """
    command = (*PYTHON, "-m", __name__, str(config), str(heard), str(os.getpid()))
    with heard.with_suffix(".log").open("wb") as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    try:
        yield
    finally:
        end_process(process)


def read_heard(heard: Path) -> Iterator[Arrival]:
    """What was heard: ns of `monotonic_ns`, key and payload."""
    with heard.open(encoding="utf-8") as lines:
        for line in lines:
            at_ns, key, payload = line.split()
            yield int(at_ns), key, bytes.fromhex(payload)


def main() -> None:
    """Be that process, until it is told to stop or its parent has died."""
    file, heard, parent = sys.argv[1:]
    stopped = stop_on_signals()
    die_with_parent(int(parent))
    config = load(Path(file))
    team = config.team.name
    go_first()
    with (
        Path(heard).open("w", encoding="utf-8") as lines,
        Bus.open(config.bus, team, OBSERVER) as bus,
    ):
        keys = EVENT.key(team), *(STATUS.key(team, n) for n in robot_names(config.team.robots))
        taken = [bus.collect(key) for key in keys]
        while not stopped():
            sleep(_LOOK_S)
            for at_ns, key, payload in sorted(arrival for take in taken for arrival in take()):
                lines.write(f"{at_ns} {key} {payload.hex()}\n")


if __name__ == "__main__":
    main()
