"""The plant or the link to the router may disappear: when that ends a process, and its error."""

from __future__ import annotations

from typing import Final, NamedTuple

from quadriga.shared.bus.diagnostics import lead
from quadriga.shared.bus.discovery import log
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codes import LEAD_GONE, LINK_LOST
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.members import has_lead
from quadriga.shared.runtime.clock import monotonic

LAST_PACKETS: Final = 1.0  # s wall, in which what was sent before may still arrive


class Loss(NamedTuple):
    """What has vanished: `LEAD_GONE` or `LINK_LOST`, and its name."""

    code: str
    what: str


def find_lost_link(bus: Bus, config: Config) -> Loss | None:
    """The link to the router, if there ought to be one and is none at the moment."""
    if config.bus.mode != "client" or bus.linked:
        return None
    return Loss(LINK_LOST, f"link of {bus.name} to the router at {config.bus.endpoint}")


def find_loss(bus: Bus, config: Config) -> Loss | None:
    """What is gone at the moment of that on which a process depends; None if all is there."""
    link = find_lost_link(bus, config)
    if link is not None or has_lead(bus.members_at(HERE)):
        return link  # without it everybody else seems to be gone, too
    return Loss(LEAD_GONE, f"process {lead(config)} of team {bus.team!r}, seen by {bus.name}")


def loss_error(loss: Loss, tick: int) -> ProcessError:
    """The error of a process that ends because of a loss at a tick, ms."""
    cause = "killed, failed, or cut off: see what it says itself"
    if loss.code == LINK_LOST:
        cause = "the router was killed, the network is gone, or a certificate has expired"
    got = f"none any more after {tick / 1000:.3f} s of the walk"
    return ProcessError(loss.what, got, "it to be there until the walk's announced end", cause)


class Liveness:
    """Ends a process whose team is gone, and says what has vanished.

    The last packets of who drives time may arrive after its token has vanished, and they announce
    the end of the walk. So a loss counts after `LAST_PACKETS`.
    """

    def __init__(self, bus: Bus, config: Config) -> None:
        self._bus, self._config = bus, config
        self._walks = False
        self._missed_since: float | None = None
        self._silent_since: float | None = None  # since the end was announced

    def is_over(self, *, announced: bool) -> bool:
        """Whether the walk is over: its end was announced, and did come.

        Whoever reaches the bus may announce one. A team whose time goes on has not ended.
        """
        if not announced:
            return False
        now = monotonic()
        if self._silent_since is None:
            self._silent_since = now
        return now - self._silent_since >= LAST_PACKETS or bool(find_loss(self._bus, self._config))

    def poll(self, tick: int) -> None:
        """See whether the others are there; called while nothing arrives, with the team's time, ms.

        Raises:
            ProcessError: who drives time, or the link to the router, is gone.
        """
        loss, now = find_loss(self._bus, self._config), monotonic()
        if loss is None or self._missed_since is None:
            self._missed_since = None if loss is None else now
        elif now - self._missed_since >= LAST_PACKETS:
            raise loss_error(loss, max(tick, 0))

    def receive(self) -> None:
        """Something has arrived: the team walks."""
        self._silent_since = self._missed_since = None
        if not self._walks:
            self._walks = True
            log(f"{self._bus.name}: the team walks")
