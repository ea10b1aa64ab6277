"""Plants on computers with clocks of their own, and a network that delays and loses messages."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import count

import numpy as np

from quadriga.plant.clock_estimate import WallReading
from quadriga.plant.team_clock import FollowingClock, LeadingClock
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import ClockAnswer, ClockAsk

MS, S = 1_000_000, 1_000_000_000
TIMEOUT = 500 * MS
AHEAD = 500 * MS
IDLE = 2 * MS

Delay = Callable[[np.random.Generator], float | None]  # ns, None: the message is lost
Parcel = tuple[int, str, ClockAsk | ClockAnswer]  # when it arrived, from whom


@dataclass
class Computer:
    """One plant: its clock, what has arrived, and true times, ns."""

    clock: LeadingClock | FollowingClock
    offset: float
    drift: float
    tick: int = 0
    first: float = 0.0  # when tick 0 begins
    begun: list[float] = field(default_factory=list)  # of tick 1 and all later ones
    off: list[int] = field(default_factory=list)  # what it says of each, see `TeamClock`
    silent_at: float | None = None  # when it first misses another
    arrived: list[Parcel] = field(default_factory=list)
    stalls: dict[int, float] = field(default_factory=dict)  # ns, by tick
    dies_at: float = np.inf
    told: int = 0  # slips

    def now(self, time: float) -> int:
        """Its clock at a true time."""
        return round(time + self.offset + self.drift * time)

    def true(self, instant: float) -> float:
        """The true time when its clock shows an instant."""
        return (instant - self.offset) / (1.0 + self.drift)


class VirtualTeam:
    """Steps plants through true time.

    Args:
        clocks: offset [ns] and drift of each computer; the first one's plant leads.
        delay: how long a message takes.
        slack: see `TeamClock`.
    """

    def __init__(
        self, clocks: Sequence[tuple[float, float]], delay: Delay, slack: int = 50 * MS
    ) -> None:
        names = [f"plant_r{k + 1}" for k in range(len(clocks))]
        self._lead, self.delay, self._random = names[0], delay, np.random.default_rng(1)
        leading = LeadingClock(names[1:], TIMEOUT, slack)
        following = [FollowingClock(self._lead, TIMEOUT, slack) for _ in names[1:]]
        parts: list[LeadingClock | FollowingClock] = [leading, *following]
        self.computers = {
            name: Computer(part, *clock)
            for name, part, clock in zip(names, parts, clocks, strict=True)
        }
        self._events: list[tuple[float, int, Callable[[float], None]]] = []
        self._serial = count()
        for name in names:
            self._at(self._random.uniform(0, MS), partial(self._pause, name))

    def run(self, until: float) -> None:
        """Go on to a true time."""
        while self._events and self._events[0][0] <= until:
            time, _, action = heapq.heappop(self._events)
            action(time)

    def late(self) -> Array:
        """By how much later than the leader's each follower's ticks began, (followers, K), ns."""
        first, *others = (computer.begun for computer in self.computers.values())
        ticks = min(map(len, (first, *others)))
        return np.array([np.subtract(other[:ticks], first[:ticks]) for other in others])

    def _at(self, time: float, action: Callable[[float], None]) -> None:
        heapq.heappush(self._events, (time, next(self._serial), action))

    def _pause(self, name: str, time: float) -> None:
        """Before the walk."""
        me = self.computers[name]
        self._attend(name, time)
        self._agree(me, time)
        if me.clock.start and not me.first:
            me.first = me.true(me.clock.walk(me.now(time)))
        if me.first and time > me.first - IDLE:
            self._at(max(time, me.first), partial(self._plan, name))
        elif time < me.dies_at:
            self._at(time + IDLE, partial(self._pause, name))

    def _agree(self, me: Computer, time: float) -> None:
        others = [other.clock for other in self.computers.values()]
        ready = all(
            clock.is_settled(other.now(time))
            for other in self.computers.values()
            if isinstance(clock := other.clock, FollowingClock)
        )
        if others[0] is me.clock and ready and not me.clock.start:
            me.clock.start = me.now(time) + AHEAD

    def _begin(self, name: str, time: float) -> None:
        """A tick begins, and its work takes a while."""
        me = self.computers[name]
        me.tick += 1
        me.clock.begin(me.now(time))
        me.begun.append(time)
        if me.silent_at is None and me.clock.silent(me.now(time)):
            me.silent_at = time
        work = self._random.uniform(0.05, 0.4) * MS + me.stalls.get(me.tick, 0.0)
        if time < me.dies_at:
            self._at(time + work, partial(self._plan, name))

    def _plan(self, name: str, time: float) -> None:
        me = self.computers[name]
        self._attend(name, time)
        begin = me.true(me.clock.plan(me.tick + 1, me.now(time)))
        me.off.append(me.clock.off)
        self._at(max(begin, time), partial(self._begin, name))

    def _attend(self, name: str, time: float) -> None:
        me = self.computers[name]
        arrived, me.arrived = me.arrived, []
        now = me.now(time)
        wall = WallReading(now, 0, 0)
        for at, sender, message in arrived:
            if isinstance(me.clock, FollowingClock) and isinstance(message, ClockAnswer):
                me.clock.take(message, at, wall)
            elif isinstance(me.clock, LeadingClock) and isinstance(message, ClockAsk):
                answer = me.clock.answer(sender, message, at, wall, me.tick)
                self._send(name, sender, answer, time)
        if isinstance(me.clock, LeadingClock) and me.clock.slips != me.told:
            me.told = me.clock.slips
            for other in list(self.computers)[1:]:
                self._send(name, other, me.clock.news_of_start(now, me.tick), time)
        ask = me.clock.ask(me.tick, now) if isinstance(me.clock, FollowingClock) else None
        if ask is not None:
            self._send(name, self._lead, ask, time)

    def _send(self, sender: str, to: str, message: ClockAsk | ClockAnswer, time: float) -> None:
        delay = self.delay(self._random)

        def arrive(time: float) -> None:
            computer = self.computers[to]
            computer.arrived.append((computer.now(time), sender, message))

        if delay is not None:
            self._at(time + delay, arrive)
