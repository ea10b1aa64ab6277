"""What is wrong with a team, and what is not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from quadriga.recordings.rates import RateFigures
from quadriga.shared.config.load import load
from quadriga.status.judge import find_problems
from quadriga.status.record import Account, MemberStatus, TeamReading

CONFIG = load(None, {"team.robots": 2})
WALKS = Account("walk", "", 50.0, {"reference": 40.0, "plan.r2": 40.0, "jitter.max": 1e6})
MEMBERS = tuple(MemberStatus(name, True, "well") for name in ("sim", "r1", "r2", "operator"))
READING = TeamReading(5000, 1.0, {"r1": WALKS, "r2": WALKS}, (), {}, {"r1": 0.02}, ())

CLOCK = RateFigures("team/clock", 95, 95.0, 95.0, 5)


def problems(reading: TeamReading = READING, linked: bool = True) -> tuple[str, ...]:
    return find_problems(CONFIG, linked, reading, MEMBERS)


def with_r2(**changes: object) -> TeamReading:
    return replace(READING, accounts={"r1": WALKS, "r2": replace(WALKS, **changes)})  # type: ignore[arg-type]


def test_a_team_that_walks_is_well() -> None:
    assert problems() == ()
    assert problems(with_r2(mode="stand")) == ()
    assert problems(replace(READING, tick=-1, accounts={})) == ()  # it has not begun


def test_without_a_link_nothing_else_is_said() -> None:
    (only,) = problems(linked=False)
    assert only.startswith("nobody of team 'team' at tcp/127.0.0.1:7447 is linked")


@pytest.mark.parametrize(
    ("reading", "problem"),
    [
        (with_r2(mode="estop", reason="estop:me"), "r2 is in mode estop, estop:me"),
        (with_r2(mode="stand", reason="peer-lost:r1"), "r2 is in mode stand, peer-lost:r1"),
        (with_r2(age_ms=1500.0), "r2 has said nothing for 1.5 s"),
        (with_r2(ages_ms={"reference": 700.0}), "r2 uses reference 700 ms old, of at most 500"),
        (replace(READING, accounts={"r1": WALKS}), "r2 says nothing of itself"),
        (
            replace(READING, late={"r1": 0.02, "r2": 0.31}),
            "r2: 31% of its commands came late: too much for its computer?",
        ),
        (replace(READING, topics=(CLOCK,), lost={"team/clock": 5}), "team/clock: 5 messages lost"),
    ],
)
def test_each_thing_that_is_wrong_is_one_line(reading: TeamReading, problem: str) -> None:
    assert problems(reading) == (problem,)


def test_words_of_a_team_that_walks_slowly_come_slowly() -> None:
    """In lock-step a second of the world may take five: its agents speak ten times in it."""
    assert problems(replace(with_r2(age_ms=3000.0), pace=0.2)) == ()


def test_few_losses_or_old_ones_are_not_wrong() -> None:
    assert problems(replace(READING, topics=(CLOCK,), lost={})) == ()
    many = replace(CLOCK, messages=995)
    assert problems(replace(READING, topics=(many,), lost={"team/clock": 5})) == ()


def test_who_is_not_well_is_named() -> None:
    members = (*MEMBERS[:3], MemberStatus("operator", False, "not well: gone"))
    assert find_problems(CONFIG, True, READING, members) == ("operator: not well: gone",)


def test_a_controller_of_ones_own_need_not_say_how_it_is() -> None:
    config = load(None, {"team.robots": 2, "team.agent_command": "walk"})
    assert find_problems(config, True, replace(READING, accounts={}), MEMBERS) == ()
