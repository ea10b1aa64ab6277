"""A process beside a team that disturbs it: `python -m quadriga.faults.bystander KIND CONFIG PID`.

It hears everything and stands still for good, or it floods the bus for a while.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Final

from quadriga.shared.bus.session import Bus
from quadriga.shared.config.load import load
from quadriga.shared.errors import BusError
from quadriga.shared.members import OBSERVER
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.signals import die_with_parent

DEAF: Final = "deaf"
FLOOD: Final = "flood"
THERE: Final = "on the bus"  # what it says once it is
FLOOD_S: Final = 2.0

_PAYLOAD: Final = bytes(4096)
_LINK_S: Final = 5.0
_LOOK_S: Final = 0.005


def main() -> None:
    """Be of one of the two kinds, in the team of a configuration, while a process lives.

    Raises:
        BusError: nobody of the team is reached.
    """
    kind, file, parent = sys.argv[1:]
    die_with_parent(int(parent))
    config = load(Path(file))
    with Bus.open(config.bus, config.team.name, OBSERVER) as bus:
        if kind == DEAF:
            bus.subscribe(f"{config.team.name}/**")
        _await_link(bus, config.bus.endpoint)
        print(THERE, flush=True)
        if kind == DEAF:
            os.kill(os.getpid(), signal.SIGSTOP)
        else:
            _flood(bus)


def _await_link(bus: Bus, endpoint: str) -> None:
    deadline = monotonic() + _LINK_S
    while not bus.get(_LOOK_S) and not bus.linked:
        if monotonic() > deadline:
            raise BusError(endpoint, f"no link after {_LINK_S:g} s", "a team")
        sleep(_LOOK_S)


def _flood(bus: Bus) -> None:
    put, deadline = (
        bus.publisher(f"{bus.team}/{OBSERVER}/flood", waits=False),
        monotonic() + FLOOD_S,
    )
    while monotonic() < deadline:
        for _ in range(100):
            put(_PAYLOAD)


if __name__ == "__main__":
    main()
