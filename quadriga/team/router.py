"""SHELL of the router: the processes of a team in client mode reach each other through it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

from quadriga.shared.bus.diagnostics import lead
from quadriga.shared.bus.session import POLL, READY, Bus
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.security.access import router_rules

_STAGES: Final = 3  # waits of the barrier: for the router, for everyone's presence, for readiness


def run(
    config: Config, listen: str, *, once: bool, stopped: Callable[[], bool] | None = None
) -> None:
    """Route until SIGINT or SIGTERM, or until one walk is over.

    Where it listens with certificates, it lets through what the team's rights permit.

    Args:
        config: the team's configuration.
        listen: the endpoint the others connect to.
        once: leave when the team of the configuration has walked and everyone has left.
        stopped: asked often whether to stop; by default a flag that the two signals raise.

    Raises:
        ConfigError: the endpoint is open to others, or a certificate is missing.
        BusError: the endpoint cannot be opened; or, with `once`, the team did not assemble.
    """
    stopped = stopped or stop_on_signals()
    rules = router_rules(config) if is_tls(listen) else {}
    with Bus.route(listen, config.team.name, config.bus, rules) as bus:
        take_priority(config.runtime.priority)  # every command waits for it
        print(f"routing at {listen}", file=sys.stderr, flush=True)
        if once:
            timeout = _STAGES * config.bus.barrier_timeout
            if not bus.wait_for(READY, [lead(config)], timeout, stopped) and not stopped():
                name, cause = (f"team {bus.team!r} at {listen}", "not started, or elsewhere")
                raise BusError(name, f"no {lead(config)} after {timeout:g} s", "a walk", cause)
        while not stopped() and (bus.linked or not once):
            sleep(POLL)
