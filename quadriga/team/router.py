"""SHELL of the router: the processes of a team in client mode reach each other through it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

from quadriga.shared.bus.barrier import lead
from quadriga.shared.bus.zenoh_bus import POLL, READY, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import stop_on_signals

_STAGES: Final = 3  # waits of the barrier: for the router, for everyone's presence, for readiness


def run(
    config: Config, listen: str, *, once: bool, stopped: Callable[[], bool] | None = None
) -> None:
    """Route until SIGINT or SIGTERM, or until one walk is over.

    Args:
        config: the team's configuration.
        listen: the endpoint the others connect to.
        once: leave when the team of the configuration has walked and everyone has left.
        stopped: asked often whether to stop; by default a flag that the two signals raise.

    Raises:
        BusError: the endpoint cannot be opened; or, with `once`, the team did not assemble.
    """
    stopped = stopped or stop_on_signals()
    with Bus.route(listen, config.team.name) as bus:
        take_priority(config.runtime.priority)  # every command waits for it
        print(f"routing at {listen}", file=sys.stderr, flush=True)
        if once:
            bus.wait_for(READY, [lead(config)], _STAGES * config.bus.barrier_timeout, stopped)
        while not stopped() and (bus.linked or not once):
            sleep(POLL)
