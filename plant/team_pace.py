"""SHELL of the team's clock: asks and answers on the bus, a common start, the wait for ticks."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final

from quadriga.plant.clock_estimate import WallReading
from quadriga.plant.end import End
from quadriga.plant.team_clock import ENOUGH_NS, FollowingClock, LeadingClock, TeamClock
from quadriga.plant.team_time import plant_gone
from quadriga.shared.bus.discovery import start_together
from quadriga.shared.bus.membership import lead
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError, MessageError
from quadriga.shared.members import has_lead, plant_name
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic_ns, sleep
from quadriga.shared.runtime.system_clock import read_clocks
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import ClockAnswer, ClockAsk, Status
from quadriga.shared.wire.topics import CLOCK_ANSWER, CLOCK_ASK

Stopped = Callable[[], bool]
Pause = Callable[[], None]

_AHEAD_NS: Final = 500_000_000  # from the agreement to the first tick: all hear of it meanwhile
_LATE_START_NS: Final = 200_000_000  # that is still caught up with
_SETTLE_NS: Final = 10_000_000_000  # from the first answer on
_QUIET_NS: Final = 2_000_000  # before the first tick, in which nothing else is done
# A robot keeps real time, and stops by itself if it cannot. A simulated world may go slower.
_ROBOT_SLACK_NS: Final = 50_000_000
_WORLD_SLACK_NS: Final = 20_000_000
_LATE_NS: Final = 1_000_000  # a tick that begins later is an overrun


def team_pace(bus: Bus, config: Config, robot: str, *, is_robot: bool) -> TeamPace | None:
    """The pace of a plant, whose subscribers it declares.

    None unless robots have plants of their own, in real time.

    Args:
        bus: where the others are; this process has not met them yet.
        config: the team's configuration.
        robot: that this is the plant of; "" of all.
        is_robot: whether it is a real one.
    """
    if not robot or config.world.mode != "realtime":
        return None
    kind = LeadingPace if robot == robot_names(config.team.robots)[0] else FollowingPace
    return kind(bus, config, robot, _ROBOT_SLACK_NS if is_robot else _WORLD_SLACK_NS)


class TeamPace(ABC):
    """Paces the ticks of one of several plants in real time.

    Attributes:
        clock: what this plant knows of the team's clock.
        overruns: ticks that began late by more than a millisecond.
    """

    clock: TeamClock

    def __init__(self, bus: Bus, config: Config) -> None:
        self._bus, self._config = bus, config
        self._tick = self.overruns = 0

    def start(self, pause: Pause, stopped: Stopped) -> bool:
        """Agree with the others on when tick 0 begins, and wait until then.

        False if `stopped()` came first. Meanwhile `pause()` is called all the time.

        Raises:
            BusError: some were not ready in time, two carry one name, the clock that leads cannot
                be known well enough, or this plant heard too late of the start.
        """

        def wait() -> None:
            self.attend()
            pause()

        if not self._agree(wait, stopped):
            return False
        first = self.clock.walk(monotonic_ns())
        late = monotonic_ns() - first
        if late > _LATE_START_NS:
            raise self._error(f"the start {1e-9 * late:.2f} s late", "to hear of it before")
        while monotonic_ns() < first - _QUIET_NS:
            if stopped():
                return False
            wait()
        sleep(1e-9 * (first - monotonic_ns()))
        return True

    def wait(self) -> float:
        """Wait until the next tick begins; how late it does, s."""
        self.attend()
        self._tick += 1
        begin = self.clock.plan(self._tick, monotonic_ns())
        sleep(1e-9 * (begin - monotonic_ns()))
        late = self.clock.begin(monotonic_ns())
        self.overruns += late > _LATE_NS
        return 1e-9 * late

    def look(self) -> End | None:
        """Why the walk must end: a plant on which this one depends is silent."""
        silent = self.clock.silent(monotonic_ns())
        return (
            plant_gone(silent, f"silent for {self._config.bus.clock_timeout:g} s")
            if silent
            else None
        )

    def describe(self, status: Status) -> Status:
        """A plant's report on itself, with what it knows of the clock."""
        return self.clock.describe(status, monotonic_ns())

    def news(self) -> str:
        """That the clock's error has become, or is no more, too large to walk by; "" if neither."""
        return self.clock.news()

    @abstractmethod
    def attend(self) -> None:
        """Take and send what is due of asks and answers."""

    @abstractmethod
    def _agree(self, wait: Pause, stopped: Stopped) -> bool:
        """Be ready with all others and know when tick 0 begins; False if `stopped()` came first."""

    def _error(self, got: str, expected: str, cause: str = "") -> BusError:
        name = f"clock of team {self._bus.team!r}, as {self._bus.name} knows it"
        return BusError(name, got, expected, cause)


class LeadingPace(TeamPace):
    """Of the first robot's plant, whose clock leads."""

    clock: LeadingClock

    def __init__(self, bus: Bus, config: Config, robot: str, slack: int) -> None:
        super().__init__(bus, config)
        team = config.team.name
        others = [name for name in robot_names(config.team.robots) if name != robot]
        timeout = round(1e9 * config.bus.clock_timeout)
        self.clock = LeadingClock(map(plant_name, others), timeout, slack)
        self._told = 0  # of the team's time being delayed
        self._asks = bus.collect(CLOCK_ASK.key(team, "*"))
        self._put = {
            CLOCK_ASK.key(team, name): (
                plant_name(name),
                bus.publisher(CLOCK_ANSWER.key(team, name), droppable=True),
            )
            for name in others
        }

    def attend(self) -> None:
        for arrived, key, payload in self._asks():
            if key not in self._put:
                continue
            try:
                ask = decode(payload, ClockAsk)
            except MessageError:
                continue
            asker, put = self._put[key]
            wall = WallReading(*read_clocks())
            put(encode(self.clock.answer(asker, ask, arrived, wall, self._tick)))
        if self._told != self.clock.slips:
            self._told = self.clock.slips
            for _, put in self._put.values():
                put(encode(self.clock.news_of_start(monotonic_ns(), self._tick)))

    def _agree(self, wait: Pause, stopped: Stopped) -> bool:
        if not start_together(self._bus, self._config, stopped, wait):
            return False
        self.clock.start = monotonic_ns() + (_AHEAD_NS if self._put else 0)
        return True


class FollowingPace(TeamPace):
    """Of any other robot's plant."""

    clock: FollowingClock

    def __init__(self, bus: Bus, config: Config, robot: str, slack: int) -> None:
        super().__init__(bus, config)
        self._lead = lead(config)
        self.clock = FollowingClock(self._lead, round(1e9 * config.bus.clock_timeout), slack)
        self._answers = bus.collect(CLOCK_ANSWER.key(config.team.name, robot))
        self._put = bus.publisher(CLOCK_ASK.key(config.team.name, robot), droppable=True)

    def attend(self) -> None:
        for arrived, _, payload in self._answers():
            try:
                answer = decode(payload, ClockAnswer)
            except MessageError:
                continue
            self.clock.take(answer, arrived, WallReading(*read_clocks()))
        ask = self.clock.ask(self._tick, monotonic_ns())
        if ask is not None:
            self._put(encode(ask))

    def _agree(self, wait: Pause, stopped: Stopped) -> bool:
        if not (
            self._settle(wait, stopped) and start_together(self._bus, self._config, stopped, wait)
        ):
            return False
        self._say_how_well()
        while not self.clock.start:
            if stopped():
                return False
            if not has_lead(self._bus.members_at(HERE)):
                raise self._error(f"{self._lead} gone", "to hear from it when to start")
            wait()
        return True

    def _settle(self, wait: Pause, stopped: Stopped) -> bool:
        """Wait until the clock is known well enough; False if `stopped()` came first."""
        timeout = round(1e9 * self._config.bus.barrier_timeout)
        deadline, first = monotonic_ns() + timeout, True
        while not self.clock.is_settled(now := monotonic_ns()):
            if stopped():
                return False
            if first and self.clock.answers:
                deadline, first = now + _SETTLE_NS, False
            if now > deadline:
                raise self._unsettled(now)
            wait()
        return True

    def _unsettled(self, now: int) -> BusError:
        expected = f"{1e-6 * ENOUGH_NS:g} ms at most"
        if not self.clock.answers:
            got = f"no answer of {self._lead} in {self._config.bus.barrier_timeout:g} s"
            return self._error(
                got, expected, "it stands up, failed to start, or has another version"
            )
        error, trip = 1e-6 * self.clock.error(now), 1e-6 * self.clock.round_trip
        got = f"an error of up to {error:.1f} ms, a round trip of at least {trip:.1f} ms"
        return self._error(
            got, expected, "a slow network; PTP or NTP on both computers is used, too"
        )

    def _say_how_well(self) -> None:
        known = self.clock.known(monotonic_ns())
        if known is None:
            return
        print(
            f"clock of {self._lead}: known to {1e-6 * known.error:.3f} ms by {known.source}, round "
            f"trip {1e-6 * self.clock.round_trip:.3f} ms, drift {1e6 * known.drift:+.0f} ppm",
            file=sys.stderr,
            flush=True,
        )
