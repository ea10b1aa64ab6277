"""SHELL of a process that hears the team's clock, before all else: when did the world reach a tick?

A recorder on a busy computer notes messages seconds after they were sent.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.load import load
from quadriga.shared.members import OBSERVER
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.scheduling import go_first
from quadriga.shared.runtime.signals import die_with_parent, stop_on_signals
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import Clock
from quadriga.shared.wire.topics import CLOCK
from quadriga.team.spectator import end_process

_LOOK_S: Final = 0.1


@contextmanager
def clock_listener(config: Path, times: Path) -> Iterator[None]:
    """Note within the block when the clock of a team is heard.

    Args:
        config: file with the configuration of the team.
        times: file to write to: a line `tick ns` for each message, the latter of `monotonic_ns`.
    """
    command = (sys.executable, "-m", __name__, str(config), str(times), str(os.getpid()))
    with times.with_suffix(".log").open("wb") as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    try:
        yield
    finally:
        end_process(process)


def main() -> None:
    """Be that process, until it is told to stop or its parent has died."""
    file, times, parent = sys.argv[1:]
    stopped = stop_on_signals()
    die_with_parent(int(parent))
    config = load(Path(file))
    go_first()
    with (
        Path(times).open("w", encoding="utf-8") as lines,
        Bus.open(config.bus, config.team.name, OBSERVER) as bus,
    ):
        heard = bus.collect(CLOCK.key(config.team.name))
        while not stopped():
            sleep(_LOOK_S)
            for at_ns, _, payload in heard():
                lines.write(f"{decode(payload, Clock).tick} {at_ns}\n")


if __name__ == "__main__":
    main()
