"""What is said of another computer's clock is true, whatever the network does."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.plant.clock_estimate import (
    MAX_DRIFT,
    PING_PONG,
    SYSTEM_CLOCK,
    WANDER,
    WINDOW,
    ClockEstimate,
    Exchange,
    WallReading,
)

MS, S = 1_000_000, 1_000_000_000
ROUNDING = 4  # ns: readings are whole
NO_WALL = WallReading(0, 0, 0)


@dataclass
class Leader:
    """A clock as mine sees it: off by hours, with a drift that swings within what it may."""

    offset: float
    drift: float
    swing: float = 0.0
    period: float = 3.0 * S

    def at(self, mine: float) -> int:
        """Its reading when mine is `mine`."""
        angle = 2.0 * math.pi * mine / self.period
        swung = self.swing * self.period / (2.0 * math.pi) * math.sin(angle)
        return round(mine + self.offset + self.drift * mine + swung)


leaders = st.builds(
    Leader,
    offset=st.floats(-1e5 * S, 1e5 * S),
    drift=st.floats(-0.9 * MAX_DRIFT, 0.9 * MAX_DRIFT),
    swing=st.floats(0.0, 0.5 * WANDER),
)
# To there, until it is answered, back: ns.
ways = st.tuples(st.floats(1e3, 3e8), st.floats(0.0, 3.0 * S), st.floats(1e3, 3e8))
quick = st.tuples(st.floats(1e5, 5e6), st.floats(0.0, 1e6), st.floats(1e5, 5e6))


def exchange(leader: Leader, asked: int, way: tuple[float, float, float]) -> Exchange:
    there, hold, back = way
    answered = asked + there + hold
    return Exchange(asked, leader.at(asked + there), leader.at(answered), round(answered + back))


@given(leaders, st.lists(ways | quick, min_size=1, max_size=90), st.data())
@settings(max_examples=60, deadline=None)
def test_the_error_is_true_whatever_each_way_takes(
    leader: Leader, taken: list[tuple[float, float, float]], data: st.DataObject
) -> None:
    estimate, now = ClockEstimate(), 5 * S
    for way in taken:
        seen = exchange(leader, now, way)
        estimate.take(seen, NO_WALL, NO_WALL)
        now = seen.arrived + data.draw(st.integers(0, 100 * MS))
        known = estimate.at_time(now)
        assert known is not None
        assert len(estimate.exchanges) == min(WINDOW, len(estimate.exchanges))
        true = leader.at(now) - now
        assert abs(known.offset - true) <= known.error + ROUNDING
        instant = leader.at(now + 50 * MS)
        mine = known.to_mine(instant)
        assert abs(mine - now - 50 * MS) <= known.error + 50e6 * known.drift_error + ROUNDING
    assert len(estimate.exchanges) == min(WINDOW, len(taken)), "a true clock is never disbelieved"


def run(
    leader: Leader, ways: list[tuple[float, float, float]], every: int = 50 * MS
) -> ClockEstimate:
    estimate = ClockEstimate()
    for k, way in enumerate(ways):
        estimate.take(exchange(leader, S + k * every, way), NO_WALL, NO_WALL)
    return estimate


def test_the_error_is_smaller_than_by_the_least_round_trip_alone() -> None:
    """Each way is quick now and then, though seldom both are; and the drift becomes known."""
    random = np.random.default_rng(1)
    jitter = 0.1e6 + random.exponential(0.4e6, (WINDOW, 2))
    estimate = run(Leader(7200 * S, 80e-6), [(there, 0.0, back) for there, back in jitter])
    now = S + WINDOW * 50 * MS
    known = estimate.at_time(now)
    assert known is not None
    alone = [0.5 * e.round_trip + MAX_DRIFT * (now - e.asked) for e in estimate.exchanges]
    assert known.error < 0.9 * min(alone)
    assert known.drift == pytest.approx(80e-6, abs=known.drift_error)
    assert known.drift_error < 0.4 * MAX_DRIFT


def test_an_even_network_tells_the_exact_offset_and_drift() -> None:
    estimate = run(Leader(-3 * S, -100e-6), [(100e3, 50e3, 100e3)] * WINDOW)
    now = S + WINDOW * 50 * MS
    known = estimate.at_time(now)
    assert known is not None
    assert known.offset == pytest.approx(-3 * S - 100e-6 * now, abs=20e3)
    assert known.drift == pytest.approx(-100e-6, abs=20e-6)
    assert known.error < 150e3
    assert estimate.round_trip == pytest.approx(200e3, abs=10)
    later = estimate.at_time(now + S)
    assert later is not None
    assert later.error > known.error, "what is not asked anew becomes less sure"


def test_a_clock_whose_rate_is_changed_is_learnt_anew() -> None:
    """As by a daemon that corrects it: what came before then counts no more."""
    slow, fast = Leader(0.0, -400e-6), Leader(0.0, 400e-6)
    estimate = run(slow, [(1e5, 0.0, 1e5)] * 20)
    about = 2 * S  # where both clocks meet
    fast.offset = slow.at(about) - fast.at(about)
    for k in range(40):
        estimate.take(exchange(fast, about + k * 50 * MS, (1e5, 0.0, 1e5)), NO_WALL, NO_WALL)
    now = about + 40 * 50 * MS
    known = estimate.at_time(now)
    assert known is not None
    assert abs(known.offset - (fast.at(now) - now)) <= known.error + ROUNDING
    assert known.drift == pytest.approx(400e-6, abs=known.drift_error)


def test_nothing_is_known_before_the_first_answer() -> None:
    assert ClockEstimate().at_time(5) is None
    assert ClockEstimate().round_trip == 0


SLOW = (8e6, 0.0, 2e6)  # a network that is too slow for 1 ms, and not even


def walls(leader: Leader, at: int, error: int, off: int = 0) -> tuple[WallReading, WallReading]:
    """Both sides' readings when mine is `at`; mine shows 1000 s more than my own clock."""
    return WallReading(leader.at(at), at + 1000 * S + off, error), WallReading(
        at, at + 1000 * S, error
    )


@pytest.mark.parametrize(("off", "source"), [(150_000, SYSTEM_CLOCK), (40 * MS, PING_PONG)])
def test_system_clocks_are_used_if_they_are_better_and_do_not_contradict(
    off: int, source: str
) -> None:
    leader, estimate = Leader(50 * S, 0.0), ClockEstimate()
    for k in range(10):
        seen = exchange(leader, k * 50 * MS, SLOW)
        estimate.take(seen, *walls(leader, seen.arrived, 100_000, off))
    known = estimate.at_time(500 * MS)
    assert known is not None
    assert (known.source, estimate.contradicted) == (source, source == PING_PONG)
    assert abs(known.offset - 50 * S) <= known.error
    assert (known.error < MS) == (source == SYSTEM_CLOCK)


def test_system_clocks_that_were_once_wrong_are_not_believed_again() -> None:
    leader, estimate = Leader(50 * S, 0.0), ClockEstimate()
    for k, off in enumerate([0, 40 * MS, 0, 0]):
        seen = exchange(leader, k * 50 * MS, SLOW)
        estimate.take(seen, *walls(leader, seen.arrived, 100_000, off))
    known = estimate.at_time(200 * MS)
    assert known is not None
    assert known.source == PING_PONG


@pytest.mark.parametrize("side", [0, 1])
def test_both_system_clocks_must_be_synchronised(side: int) -> None:
    leader, estimate = Leader(50 * S, 0.0), ClockEstimate()
    seen = exchange(leader, 0, SLOW)
    pair = list(walls(leader, seen.arrived, 100_000))
    pair[side] = replace(pair[side], error=0)
    estimate.take(seen, *pair)
    known = estimate.at_time(seen.arrived)
    assert known is not None
    assert known.source == PING_PONG
