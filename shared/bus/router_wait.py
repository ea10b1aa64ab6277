"""A process's wait for its router: how long, and what it says meanwhile."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

from quadriga.shared.bus.zenoh_settings import NO_LINK
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import monotonic, sleep

_QUIET: Final = 5.0  # s without a router that need no word


class RouterWait:
    """Decides after each attempt to reach a router whether there is another one.

    Args:
        bus: the configuration.
        name: of the process.
        stopped: asked whether to stop; None: nobody waits.
        pause: s, between two attempts.
    """

    def __init__(
        self, bus: BusConfig, name: str, stopped: Callable[[], bool] | None, pause: float
    ) -> None:
        self._bus, self._name, self._stopped, self._pause = bus, name, stopped, pause
        self._begun, self._quiet = monotonic(), True

    def go_on(self, error: BusError) -> None:
        """Wait a moment after an attempt that has failed.

        Raises:
            BusError: that of the attempt, if waiting is no use or has been long enough.
            KeyboardInterrupt: `stopped()`.
        """
        waited = monotonic() - self._begun
        most = self._bus.barrier_timeout if self._stopped else 0.0
        if NO_LINK not in error.got or waited > most:
            raise error
        if self._stopped and self._stopped():
            raise KeyboardInterrupt
        if self._quiet and waited > _QUIET:
            self._quiet = False
            said = f"quadriga: {self._name} waits for a router at {self._bus.endpoint}"
            print(said, file=sys.stderr, flush=True)
        sleep(self._pause)
