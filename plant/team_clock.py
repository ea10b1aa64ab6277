"""The team's clock in real time, as each of several plants keeps it: one leads, others follow.

Tick k begins when the clock of the plant that leads shows `start + k` ms. The others estimate that
clock by asks and answers, and hold their ticks by it. Nobody's ticks jump or repeat: see
`plant.tick_schedule`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

from quadriga.plant.clock_estimate import (
    PING_PONG,
    SYSTEM_CLOCK,
    ClockEstimate,
    Exchange,
    KnownOffset,
    WallReading,
)
from quadriga.plant.tick_schedule import TICK_NS, TickSchedule
from quadriga.shared.wire.messages import ClockAnswer, ClockAsk, Status

ENOUGH_NS: Final = 1_000_000  # error of a clock by which a robot may walk
_ASK_NS: Final = 50_000_000  # between two asks before the walk
_ASK_WALKING_NS: Final = 100_000_000
_ASKED: Final = 64  # asks whose answers are still taken
_LEAST_EXCHANGES: Final = 8  # before a clock is believed to be known
_ABSENCE_NS: Final = 50_000_000  # since the last tick: this plant was away, not the others
_COUNTED: Final = {PING_PONG: "clock.by_ping_pong", SYSTEM_CLOCK: "clock.by_system_clock"}


class TeamClock:
    """What both have in common.

    Args:
        others: plants that are listened to.
        timeout: silence after which one is given up, ns.
        slack: lateness from which on the team's time goes on later, ns.

    Attributes:
        start: when tick 0 begins, ns of the clock that leads; 0: not agreed yet.
        late: how late the newest tick began by the clock that leads, ns.
        off: how far the planned tick may be off the clock that leads, ns.
    """

    def __init__(self, others: Iterable[str], timeout: int, slack: int) -> None:
        self.start, self.late, self.off = 0, 0, 0
        self._heard = dict.fromkeys(others, 0)
        self._timeout, self._slack = timeout, slack
        self._schedule, self._due = TickSchedule(0), 0
        self._worst, self._reported, self._is_enough = 0, 0, True

    def to_mine(self, instant: int, now: int) -> int:
        """This plant's clock when that which leads shows `instant`."""
        return instant

    def error(self, now: int) -> int:
        """How far `to_mine` may be off, ns."""
        return 0

    def walk(self, now: int) -> int:
        """Have tick 0 begin, at once or soon; when, ns of this plant's clock."""
        first = self.to_mine(self.start, now)
        self._schedule = TickSchedule(first + TICK_NS)
        self._heard = dict.fromkeys(self._heard, max(now, first))
        return first

    def plan(self, tick: int, now: int) -> int:
        """When the tick after the newest is to begin, ns of this plant's clock."""
        self._due = self.to_mine(self.start + tick * TICK_NS, now)
        begin = self._schedule.plan(self._due)
        self.off = self.error(now) + abs(self._schedule.planned - self._due)
        self._worst = max(self._worst, self.off)
        return begin

    def begin(self, now: int) -> int:
        """Note that the planned tick begins now; how late it is, ns."""
        absence = now - self._schedule.begun
        if absence > _ABSENCE_NS:
            self._heard = {name: at + absence for name, at in self._heard.items()}
        self._schedule.begin(now)
        self.late = max(now - self._due, 0)
        return self.late

    def silent(self, now: int) -> list[str]:
        """Plants that have said nothing for too long."""
        return sorted(name for name, at in self._heard.items() if now - at > self._timeout)

    def describe(self, status: Status, now: int) -> Status:
        """A plant's report on itself, with what it knows of the clock.

        `ages_ms` has `clock.error`: how far its ticks may have been off the clock at most since the
        last report, ms.
        """
        self._reported, self._worst = self._worst, 0
        ages, counters = self._figures(now)
        ages = {**status.ages_ms, "clock.error": 1e-6 * self._reported, **ages}
        return replace(status, ages_ms=ages, counters={**status.counters, **counters})

    def news(self) -> str:
        """That the error of the last report has crossed what is enough, in words; "" if not."""
        was, self._is_enough = self._is_enough, self._reported <= ENOUGH_NS
        if was == self._is_enough:
            return ""
        return f"its clock is known to {1e-6 * self._reported:.1f} ms{' again' * self._is_enough}"

    def _figures(self, now: int) -> tuple[Mapping[str, float], Mapping[str, int]]:
        return {}, {}


class LeadingClock(TeamClock):
    """The clock of the plant that leads; `slips` counts how often the team's time was delayed."""

    def __init__(self, others: Iterable[str], timeout: int, slack: int) -> None:
        super().__init__(others, timeout, slack)
        self.slips = 0

    def answer(
        self, asker: str, ask: ClockAsk, arrived: int, wall: WallReading, tick: int
    ) -> ClockAnswer:
        """The answer to a plant's ask, to be sent when this plant's clock shows `wall.clock`."""
        self._heard[asker] = max(self._heard.get(asker, 0), arrived)
        late = ask.late_ns - (self.start - ask.start_ns)  # it may not know of the newest delay
        if ask.start_ns and late > self._slack:
            self._slip(late)
        known = (wall.clock, wall.wall, wall.error, self.start)
        return ClockAnswer(tick, tick * TICK_NS, ask.asked_ns, arrived, *known)

    def news_of_start(self, now: int, tick: int) -> ClockAnswer:
        """What tells at once, unasked, that the team's time has been delayed."""
        return ClockAnswer(tick, tick * TICK_NS, 0, now, now, 0, 0, self.start)

    def begin(self, now: int) -> int:
        late = super().begin(now)
        if late > self._slack:
            self._slip(late)
        return late

    def _slip(self, late: int) -> None:
        self.start += late
        self.slips += 1

    def _figures(self, now: int) -> tuple[Mapping[str, float], Mapping[str, int]]:
        return {}, {"clock.leads": 1, "clock.slips": self.slips}


class FollowingClock(TeamClock):
    """The clock of any other plant, which estimates the one that leads.

    Args:
        lead: the plant that leads.
    """

    def __init__(self, lead: str, timeout: int, slack: int) -> None:
        super().__init__((lead,), timeout, slack)
        self._lead = lead
        self._asked: dict[int, None] = {}
        self._next_ask = 0
        self._clock = ClockEstimate()
        self.answers, self._answered = 0, 0

    def known(self, now: int) -> KnownOffset | None:
        """What is known of the clock that leads."""
        return self._clock.at_time(now)

    @property
    def round_trip(self) -> int:
        """The least round trip of late, ns; 0 before the first answer."""
        return self._clock.round_trip

    def is_settled(self, now: int) -> bool:
        """Whether the clock is known well enough to walk by it."""
        return self.answers >= _LEAST_EXCHANGES and self.error(now) <= ENOUGH_NS

    def to_mine(self, instant: int, now: int) -> int:
        known = self.known(now)
        return instant if known is None else known.to_mine(instant)

    def error(self, now: int) -> int:
        known = self.known(now)
        return 0 if known is None else known.error

    def ask(self, tick: int, now: int) -> ClockAsk | None:
        """The ask to be sent now; None: none is due."""
        if now < self._next_ask:
            return None
        self._next_ask = now + (_ASK_WALKING_NS if tick else _ASK_NS)
        self._asked[now] = None
        while len(self._asked) > _ASKED:
            del self._asked[next(iter(self._asked))]
        return ClockAsk(tick, tick * TICK_NS, now, self.start, self.late)

    def take(self, answer: ClockAnswer, arrived: int, mine: WallReading) -> None:
        """Learn from an answer; one to no ask of this plant, or older than another, is none."""
        asked = answer.asked_ns
        exchange = Exchange(asked, answer.received_ns, answer.answered_ns, arrived)
        if answer.answered_ns < max(answer.received_ns, self._answered):
            return
        if asked and (asked not in self._asked or exchange.round_trip < 0):
            return
        self.start, self._answered = answer.start_ns, answer.answered_ns
        self._heard[self._lead] = max(self._heard[self._lead], arrived)
        if asked:
            del self._asked[asked]
            self.answers += 1
            leader = WallReading(answer.answered_ns, answer.wall_ns, answer.wall_error_ns)
            self._clock.take(exchange, leader, mine)

    def _figures(self, now: int) -> tuple[Mapping[str, float], Mapping[str, int]]:
        known = self.known(now)
        if known is None:
            return {}, {}
        ages = {"clock.round_trip": 1e-6 * self.round_trip, "clock.drift_ppm": 1e6 * known.drift}
        return ages, {"clock.answers": self.answers, _COUNTED[known.source]: 1}
