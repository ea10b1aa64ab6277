"""SHELL of real time with a plant for each robot: tick k begins at T0 + k ms by the system clock.

PTP or chrony keeps the system clocks of a team's computers equal. The plant that drives time sets
T0, which the others read in what it says of itself. Who is late begins its ticks half a millisecond
apart until it is on time: none is left out, and none comes twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from quadriga.plant.end import End
from quadriga.shared import codes
from quadriga.shared.about import ABOUT
from quadriga.shared.bus.diagnostics import (
    CLOCK_REMEDY,
    PACE_LIMIT,
    ClockOffset,
    MemberAnswer,
    lead,
)
from quadriga.shared.bus.discovery import ProcessInfo, ask, ask_clock, read_about, start_together
from quadriga.shared.bus.session import HERE, Answers, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import LEADS, has_lead
from quadriga.shared.messages import Status
from quadriga.shared.runtime.clock import monotonic_ns, sleep, wall_ns, wall_offset

_TICK_NS: Final = 1_000_000
_LEAST_GAP_NS: Final = _TICK_NS // 2  # between the beginnings of two ticks
_AHEAD_NS: Final = 500_000_000  # from when T0 is set: all hear of it meanwhile
_QUIET_NS: Final = 2_000_000  # before T0, in which nothing else is done
_ASK_TICKS: Final = 2000  # between two comparisons with the plant that drives time
_ASK_S: Final = 1.0  # for which an answer is awaited
_SAME: Final = ClockOffset(0.0, 0.0)
# A daemon may move the system clock against the monotonic one by this much from one reading, every
# 10 ms, to the next. Where the system is Linux both go at one rate, and this stays unused.
_MOST_SHIFT_NS: Final = 2000


class SystemClock:
    """The system clock as the monotonic one shows it: whoever sets it moves no tick.

    Args:
        offset: the system clock minus the monotonic one, ns.

    Attributes:
        set_by: by how much it has been set since, ns; 0: by less than 1 ms.
    """

    def __init__(self, offset: int) -> None:
        self._offset, self.set_by = offset, 0

    def compare(self, offset: int, error: int) -> None:
        """Follow a later reading of the offset, that may be off by `error` ns, slowly."""
        change = offset - self._offset
        if abs(change) - error > 1e9 * PACE_LIMIT:
            self.set_by = change
        self._offset += max(-_MOST_SHIFT_NS, min(change, _MOST_SHIFT_NS))

    def to_monotonic(self, instant: int) -> int:
        """What the monotonic clock shows when the system clock shows `instant`, ns."""
        return instant - self._offset


class TeamPace:
    """Begins the ticks of one of several plants.

    Args:
        bus: where the others are; this process has met them.
        config: the team's configuration.
        me: what this plant says of itself.

    Attributes:
        overruns: ticks that began late by more than a millisecond.
        offset: of the system clock from that of the plant that drives time, when they were
            compared last; None: this is that plant.
    """

    def __init__(self, bus: Bus, config: Config, me: ProcessInfo) -> None:
        self._bus, self._config, self._me = bus, config, me
        self._lead = "" if bus.name in LEADS else lead(config)
        self._clock, self._start = SystemClock(0), 0
        self._tick = self._ask_at = self._begun = self.overruns = 0
        self.offset: ClockOffset | None = None
        self._question: Answers | None = None
        self._is_off = False

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
        self.offset = _SAME - answer.clock_offset
        if self.offset.exceeds(PACE_LIMIT):
            got, cause = f"{self.offset} that of {self._lead}", CLOCK_REMEDY
            raise BusError(name, got, f"{1e3 * PACE_LIMIT:g} ms at most", cause)

    def start(self, pause: Callable[[], None], stopped: Callable[[], bool]) -> bool:
        """Be ready with all others, and wait until T0; False if `stopped()` came first.

        Meanwhile `pause()` is called all the time.

        Raises:
            BusError: some were not ready in time, two carry one name, or the plant that drives
                time left before it said when the walk begins.
        """
        if not start_together(self._bus, self._config, stopped, pause):
            return False
        if self._lead:
            self._start = self._hear_start(pause, stopped)
        else:
            self._start = self._me.start_ns = wall_ns() + _AHEAD_NS
        self._clock = SystemClock(wall_offset()[0])
        first = self._clock.to_monotonic(self._start)
        while monotonic_ns() < first - _QUIET_NS:
            if stopped():
                return False
            pause()
        sleep(1e-9 * (first - monotonic_ns()))
        self._begun = monotonic_ns()
        return not stopped()

    def _hear_start(self, pause: Callable[[], None], stopped: Callable[[], bool]) -> int:
        """T0, as the plant that drives time says; 0 if `stopped()` came first."""
        while not stopped():
            if not has_lead(self._bus.members_at(HERE)):
                name, cause = f"{self._lead} of team {self._bus.team!r}", "see what it says itself"
                raise BusError(name, "gone", "it to say when the walk begins", cause)
            for answer in ask(self._bus, (self._lead,), pause).get(self._lead, ()):
                if answer.about is not None and answer.about.start_ns:
                    return answer.about.start_ns
        return 0

    def wait(self) -> float:
        """Wait until the next tick begins; how late it does, s."""
        self._tick += 1
        due = self._clock.to_monotonic(self._start + self._tick * _TICK_NS)
        sleep(1e-9 * (max(due, self._begun + _LEAST_GAP_NS) - monotonic_ns()))
        self._begun = monotonic_ns()
        late = max(self._begun - due, 0)
        self.overruns += late > _TICK_NS
        return 1e-9 * late

    def look(self) -> End | None:
        """Read the clocks, every 10 ms; why the walk must end: the system clock was set."""
        self._clock.compare(*wall_offset())
        if self._lead:
            self._compare()
        if not self._clock.set_by:
            return None
        by = 1e-6 * self._clock.set_by
        return End(codes.CLOCK_SET, f"the system clock of {self._bus.name} was set by {by:+.3g} ms")

    def _compare(self) -> None:
        """Ask the plant that drives time now and then what its system clock shows."""
        question = self._question
        for arrived, _, payload in question.take() if question else ():
            about = read_about(self._lead, payload)
            if question and about is not None:
                answer = MemberAnswer(about, question.asked_ns, arrived)
                self.offset = _SAME - answer.clock_offset
        if self._tick >= self._ask_at:
            self._ask_at = self._tick + _ASK_TICKS
            self._question = self._bus.ask(ABOUT.key(self._bus.team, self._lead), _ASK_S)

    def news(self) -> str:
        """That the system clock is off since the last look, in words; "" if not."""
        was_off, self._is_off = self._is_off, bool(self.offset and self.offset.exceeds(PACE_LIMIT))
        is_news = self._is_off and not was_off
        return f"its system clock is {self.offset} that of {self._lead}" if is_news else ""

    def describe(self, status: Status) -> Status:
        """A plant's report on itself, with what it knows of the clocks.

        `ages_ms` has `clock.offset`: how far the system clock was ahead of that of the plant that
        drives time when they were compared last, and `clock.error`: how far that may be off.
        """
        if self.offset is None:
            return status
        offset, error = (1e3 * part for part in self.offset)
        ages = {**status.ages_ms, "clock.offset": offset, "clock.error": error}
        return replace(status, ages_ms=ages)
