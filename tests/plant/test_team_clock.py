"""Plants on several computers begin each tick together, or know that they do not."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.plant.clock_estimate import WallReading
from quadriga.plant.team_clock import ENOUGH_NS, FollowingClock, LeadingClock
from quadriga.shared.wire.messages import ClockAnswer, ClockAsk, Status
from tests.plant.virtual_team import MS, TIMEOUT, Delay, S, VirtualTeam

HOUR = 3600.0 * S
CLOCKS = [(2 * HOUR, 20e-6), (5 * HOUR, -80e-6), (0.0, 120e-6)]


def lan(random: np.random.Generator) -> float:
    """A wired network: ns."""
    return 100e3 + random.exponential(100e3)


def wireless(random: np.random.Generator) -> float | None:
    """Jitter of milliseconds, and every tenth message is lost: ns."""
    return None if random.random() < 0.1 else 300e3 + random.exponential(1.5e6)


def walk(delay: Delay, seconds: float = 3.0) -> VirtualTeam:
    team = VirtualTeam(CLOCKS, delay)
    team.run(seconds * S)
    assert all(computer.begun for computer in team.computers.values())
    return team


@pytest.mark.parametrize(("delay", "median"), [(lan, 60e3), (wireless, 500e3)])
def test_ticks_begin_together_on_computers_hours_apart(delay: Delay, median: float) -> None:
    team = walk(delay)
    late = np.abs(team.late())
    assert late.shape[1] > 1500
    assert np.max(late) <= ENOUGH_NS
    assert np.median(late) <= median
    for computer in team.computers.values():
        gaps = np.diff(computer.begun)
        assert np.min(gaps) > 0.45 * MS
        assert np.max(gaps) < 1.55 * MS


@given(
    st.lists(st.tuples(st.floats(0.0, HOUR), st.floats(-100e-6, 100e-6)), min_size=2, max_size=3),
    st.floats(0.0, 1e6),
    st.floats(0.0, 1e6),
)
@settings(max_examples=8, deadline=None)
def test_no_tick_is_further_off_than_its_plant_says(
    clocks: list[tuple[float, float]], there: float, back: float
) -> None:
    """However unlike both ways are: that is what nobody can see."""
    turn = iter(range(10**9))
    team = VirtualTeam(
        clocks, lambda random: (there, back)[next(turn) % 2] + random.exponential(2e5)
    )
    team.run(2.5 * S)
    for late, computer in zip(team.late(), list(team.computers.values())[1:], strict=True):
        assert len(late) > 1000
        assert np.all(np.abs(late) <= np.array(computer.off[: len(late)]) + 2e3)


def test_a_follower_holds_time_by_itself_when_answers_stop_and_gives_the_leader_up() -> None:
    team = walk(lan, 2.0)
    lost = 2.0 * S
    team.delay = lambda _random: None
    team.run(lost + 2.0 * S)
    assert np.max(np.abs(team.late())) < 0.5 * MS, "the drift is known, so nothing runs away"
    for name, computer in team.computers.items():
        assert computer.silent_at is not None, name
        assert TIMEOUT - 120 * MS < computer.silent_at - lost < TIMEOUT + 120 * MS
        assert name == "plant_r1" or computer.off[-1] > computer.off[1000], "and says so"


def test_a_leader_that_dies_is_missed_and_nothing_jumps() -> None:
    team = walk(lan, 2.0)
    team.computers["plant_r1"].dies_at = 2.0 * S
    team.run(3.0 * S)
    for name in ("plant_r2", "plant_r3"):
        computer = team.computers[name]
        assert computer.silent_at is not None
        assert computer.silent_at - 2.0 * S < TIMEOUT + 120 * MS
        assert np.max(np.abs(np.diff(computer.begun) - MS)) < 0.1 * MS


@pytest.mark.parametrize("name", ["plant_r1", "plant_r2"])
def test_who_stood_still_itself_accuses_nobody_and_catches_up(name: str) -> None:
    team = walk(lan, 2.0)
    computer = team.computers[name]
    computer.stalls[computer.tick + 100] = 45.0 * MS
    computer.stalls[computer.tick + 500] = 1.2 * TIMEOUT
    team.run(3.8 * S)
    assert computer.silent_at is None
    assert np.min(np.diff(computer.begun)) > 0.45 * MS
    others = [other for other in team.computers if other not in (name, "plant_r1")]
    assert team.computers[others[0]].silent_at is None or name == "plant_r1"


@pytest.mark.parametrize("slow", ["plant_r1", "plant_r2"])
def test_simulated_worlds_wait_for_one_that_is_slow(slow: str) -> None:
    """Robots keep real time; simulated ones would only be late with everything."""
    team = VirtualTeam(CLOCKS, lan, slack=3 * MS)
    team.run(2.0 * S)
    computer = team.computers[slow]
    computer.stalls = dict.fromkeys(range(computer.tick, computer.tick + 2000), 1.0 * MS)
    team.run(4.0 * S)
    ticks = [len(other.begun) for other in team.computers.values()]
    assert max(ticks) - min(ticks) < 60
    leading = team.computers["plant_r1"].clock
    assert isinstance(leading, LeadingClock)
    assert leading.slips
    assert max(other.off[-1] for other in team.computers.values()) < 30 * MS, "no more than is lost"


def answer(asked: int, **more: int) -> ClockAnswer:
    given = {"received_ns": 50, "answered_ns": 60, "wall_ns": 0, "wall_error_ns": 0, "start_ns": 7}
    return ClockAnswer(tick=0, stamp_ns=0, asked_ns=asked, **{**given, **more})


def test_what_was_not_asked_for_or_cannot_be_is_not_taken() -> None:
    clock, wall = FollowingClock("plant_r1", TIMEOUT, MS), WallReading(200, 0, 0)
    ask = clock.ask(0, 100)
    assert ask is not None
    assert clock.ask(0, 101) is None, "it is soon enough later"
    for forged in (
        answer(99),
        answer(100, answered_ns=40),
        answer(100, received_ns=0, answered_ns=900),
    ):
        clock.take(forged, 200, wall)
    assert (clock.answers, clock.start) == (0, 0)
    assert clock.known(200) is None
    second = clock.ask(0, S)
    assert second is not None
    for _ in range(2):
        clock.take(answer(S), S + 200, wall)
    assert (clock.answers, clock.start) == (1, 7)


def test_that_time_is_delayed_is_heard_at_once_and_teaches_nothing_else() -> None:
    leads, follows = (
        LeadingClock(["plant_r2"], TIMEOUT, MS),
        FollowingClock("plant_r1", TIMEOUT, MS),
    )
    leads.start = S
    leads.walk(S)
    leads.begin(leads.plan(1, S) + 5 * MS)
    assert (leads.start, leads.slips, leads.late) == (S + 5 * MS, 1, 5 * MS)
    follows.take(leads.news_of_start(2 * S, 5), 100, WallReading(100, 0, 0))
    assert (follows.start, follows.answers, follows.known(100)) == (leads.start, 0, None)


def test_a_plant_that_has_not_heard_of_a_delay_is_late_by_so_much_less() -> None:
    leads, wall = LeadingClock(["plant_r2"], TIMEOUT, 10 * MS), WallReading(2 * S, 0, 0)
    leads.start = S + 30 * MS
    for late, slips in ((39 * MS, 0), (45 * MS, 1), (45 * MS, 1)):
        leads.answer("plant_r2", ClockAsk(9, 0, 7, S, late), S, wall, 9)
        assert leads.slips == slips
    assert leads.start == S + 45 * MS
    leads.answer("plant_r2", ClockAsk(0, 0, 7, 0, 0), S, wall, 9)
    assert leads.slips == 1, "it has not begun"


def test_a_status_tells_source_error_drift_and_round_trip() -> None:
    team = walk(lan)
    empty = Status(0, 0, "realtime", "", "", {"jitter.max": 1.0}, {"ticks": 5}, *np.zeros((2, 0)))
    now = 3 * S
    told = {n: c.clock.describe(empty, c.now(now)) for n, c in team.computers.items()}
    assert told["plant_r1"].counters == {"ticks": 5, "clock.leads": 1, "clock.slips": 0}
    assert told["plant_r1"].ages_ms == {
        "jitter.max": 1.0,
        "clock.error": pytest.approx(0.0, abs=1e-6),
    }
    follows = told["plant_r2"]
    assert follows.counters["clock.by_ping_pong"] == 1
    assert follows.counters["clock.answers"] > 20
    assert 0.0 < follows.ages_ms["clock.error"] < 1.0
    assert follows.ages_ms["clock.drift_ppm"] == pytest.approx(100.0, abs=100.0)
    assert 0.2 <= follows.ages_ms["clock.round_trip"] < 0.5


def test_it_is_news_when_the_error_crosses_what_is_enough() -> None:
    def even(_random: np.random.Generator) -> float:
        return 0.8 * MS

    team, news = VirtualTeam(CLOCKS, even), list[str]()
    computer = team.computers["plant_r2"]
    empty = Status(0, 0, "realtime", "", "", {}, {}, *np.zeros((2, 0)))
    for until, delay in ((2, even), (6, lambda _random: None), (7, even), (8, even)):
        team.delay = delay
        team.run(until * S)
        computer.clock.describe(empty, computer.now(until * S))
        news.append(computer.clock.news())
    assert news[0] == news[2] == ""
    assert re.fullmatch(r"its clock is known to \d+\.\d ms", news[1])
    assert news[3].endswith(" ms again")
