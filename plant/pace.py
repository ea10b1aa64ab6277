"""SHELL of real time with a plant for each robot: tick k begins at T0 + k ms by the system clock.

PTP or chrony keeps the system clocks of a team's computers equal. The plant that drives time sets
T0, which the others read in what it says of itself. From T0 on ticks go by the monotonic clock,
whose rate PTP sets too, so that who sets the system clock moves no tick. Who is late begins its
ticks half a millisecond apart until it is on time: none is left out, and none comes twice.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.shared.bus.diagnostics import CLOCK_REMEDY, PACE_LIMIT, clock_difference, lead
from quadriga.shared.bus.discovery import ProcessInfo, ask, ask_clock
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import LEADS, has_lead
from quadriga.shared.runtime.clock import monotonic_ns, sleep, wall_ns, wall_offset_ns

_TICK_NS: Final = 1_000_000
_LEAST_GAP_NS: Final = _TICK_NS // 2  # between the beginnings of two ticks
_AHEAD_NS: Final = 500_000_000  # from when T0 is set: all hear of it meanwhile
_QUIET_NS: Final = 2_000_000  # before T0, in which nothing else is done


class TeamPace:
    """Begins the ticks of one of several plants.

    Args:
        bus: where the others are; this process has met them.
        config: the team's configuration.
        me: what this plant says of itself.

    Attributes:
        overruns: ticks that began late by more than a millisecond.
    """

    def __init__(self, bus: Bus, config: Config, me: ProcessInfo) -> None:
        self._bus, self._config, self._me = bus, config, me
        self._lead = "" if bus.name in LEADS else lead(config)
        self._start = self._tick = self._begun = self.overruns = 0

    def check_clock(self) -> None:
        """Refuse to walk by a system clock that is off.

        Raises:
            BusError: it differs by more than 1 ms from that of the plant that drives time, or that
                does not answer.
        """
        if not self._lead:
            return
        name, answer = f"system clock of {self._bus.name}", ask_clock(self._bus, self._lead)
        if answer is None:
            cause = "it is frozen or overloaded, or has another version of quadriga"
            raise BusError(name, f"no answer of {self._lead}", "its system clock", cause)
        ahead, error = answer.clock_offset
        if off := clock_difference(-ahead, error, PACE_LIMIT):
            got, cause = f"{off} that of {self._lead}", CLOCK_REMEDY
            raise BusError(name, got, f"{1e3 * PACE_LIMIT:g} ms at most", cause)

    def start(self, pause: Callable[[], None], stopped: Callable[[], bool]) -> bool:
        """Wait until T0, once all are ready; False if `stopped()` came first.

        Meanwhile `pause()` is called all the time.

        Raises:
            BusError: the plant that drives time left before it said when the walk begins.
        """
        start = 0
        if not self._lead:
            start = self._me.start_ns = wall_ns() + _AHEAD_NS
        while not start and not stopped():
            if not has_lead(self._bus.members_at(HERE)):
                name, cause = f"{self._lead} of team {self._bus.team!r}", "see what it says itself"
                raise BusError(name, "gone", "it to say when the walk begins", cause)
            for answer in ask(self._bus, (self._lead,), pause).get(self._lead, ()):
                start = start or (answer.about.start_ns if answer.about is not None else 0)
        self._start = start - wall_offset_ns()
        while monotonic_ns() < self._start - _QUIET_NS:
            if stopped():
                return False
            pause()
        sleep(1e-9 * (self._start - monotonic_ns()))
        self._begun = monotonic_ns()
        return not stopped()

    def wait(self) -> float:
        """Wait until the next tick begins; how late it does, s."""
        self._tick += 1
        due = self._start + self._tick * _TICK_NS
        sleep(1e-9 * (max(due, self._begun + _LEAST_GAP_NS) - monotonic_ns()))
        self._begun = monotonic_ns()
        late = max(self._begun - due, 0)
        self.overruns += late > _TICK_NS
        return 1e-9 * late
