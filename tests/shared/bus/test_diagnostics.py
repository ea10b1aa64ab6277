"""Why a member is not there, out of tokens and answers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from quadriga.shared.about import About
from quadriga.shared.bus.diagnostics import (
    BAD,
    GOOD,
    NOTE,
    TeamNorm,
    TeamView,
    describe_absent,
    diagnose,
    disagreements,
    refuse,
)
from quadriga.shared.errors import BusError
from quadriga.shared.members import Member, team_members
from tests.shared.bus.abouts import NAMES, SIM, about, answer, view

MEMBERS = {m.name: m for m in team_members(("r1", "r2"), central=False, recorded=False)}
R1, R2 = MEMBERS["r1"], MEMBERS["r2"]
EVERYBODY = (SIM, about("r1"), about("r2"))


def codes(member: Member, seen: TeamView) -> list[tuple[str, str]]:
    return [(item.code, item.verdict) for item in diagnose(member, seen)]


def of_r2(**changes: Any) -> list[tuple[str, str]]:
    return codes(R2, view(SIM, about("r1"), about("r2", **changes)))


def test_who_is_ready_and_agrees_is_well() -> None:
    for member in (R1, R2, MEMBERS["sim"]):
        assert codes(member, view(*EVERYBODY)) == [("ready", GOOD)]


@pytest.mark.parametrize(
    ("seen", "code", "words"),
    [
        (view(SIM, about("r1"), here=NAMES), "not-answering", "here, but does not answer"),
        (
            view(SIM, about("r1", sees=("sim",)), here=frozenset({"sim", "r1"})),
            "not-reachable",
            "seen by sim, but not from here",
        ),
        (
            view(about("r1", sees=("sim",)), here=frozenset({"r1"})),
            "not-started",
            "not on the bus: not started",
        ),
        (view(here=frozenset(), linked=False), "no-link", "no link to anyone"),
        (
            view(*EVERYBODY, answers={"r2": [answer(None)]}),
            "unreadable",
            "says what this version cannot read",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_silence_has_a_reason(seen: TeamView, code: str, words: str) -> None:
    (item,) = diagnose(R2, seen)
    assert (item.code, item.verdict) == (code, BAD)
    assert item.text.startswith(words)
    assert bool(item.remedy) == (code != "no-link")


def test_who_is_not_started_is_told_with_the_command_that_starts_it() -> None:
    alone = view(about("r1", sees=()), here=frozenset({"r1"}))
    assert "`quadriga agent --robot r2`" in diagnose(R2, alone)[0].remedy


@pytest.mark.parametrize(
    ("stage", "sees", "text"),
    [
        ("started", (), "on the bus, has not announced itself yet"),
        ("here", ("sim",), "here, waits for r1"),
        ("warming-up", ("r1", "sim"), "still warming up"),
    ],
)
def test_how_far_a_process_is(stage: str, sees: tuple[str, ...], text: str) -> None:
    seen = view(SIM, about("r2", stage=stage, sees=sees), here=frozenset({"sim", "r2"}))
    (item,) = diagnose(R2, seen)
    assert (item.code, item.verdict, item.text) == (stage, NOTE, text)


def test_who_does_not_see_another_that_is_here_is_told() -> None:
    assert of_r2(sees=("sim",)) == [("ready", GOOD), ("not-seen", BAD)]
    assert of_r2(sees=(), stage="started") == [("started", NOTE)], "it has not looked yet"


def test_differences_that_no_team_walks_with_are_bad_and_others_are_notes() -> None:
    assert of_r2(config=("world.seed=4",), predictor="xyz", code="other") == [
        ("ready", GOOD),
        ("other-configuration", BAD),
        ("other-predictor", BAD),
        ("other-code", NOTE),
    ]
    assert ("other-version", BAD) in of_r2(version="9")
    assert of_r2(predictor="abc") == [("ready", GOOD)]
    seen = view(*EVERYBODY[:2], about("r2", version="9"), norm=None)
    assert codes(R2, seen) == [("ready", GOOD)], "nobody knows what would be right"


@pytest.mark.parametrize(
    ("ahead_ns", "took_ns", "text"),
    [
        (90_000_000, 0, ""),
        (3_000_000_000, 10**6, "its system clock is 3 s ahead of this computer's"),
        (-300_000_000, 10**6, "its system clock is 300 ms behind this computer's"),
        (300_000_000, 500_000_000, ""),  # it may be right: the answer took long
    ],
)
def test_a_clock_is_off_by_more_than_what_the_question_took(
    ahead_ns: int, took_ns: int, text: str
) -> None:
    said = answer(about("r2", wall_ns=10**18 + ahead_ns), took_ns)
    found = diagnose(R2, view(*EVERYBODY, answers={"r2": [said]}))
    assert [item.text for item in found if item.code == "clock-off"] == [text] * bool(text)


PACED = about("plant_r1", config=("team.plant_per_robot=true", 'world.mode="realtime"'))
EACH = team_members(("r1", "r2"), central=False, recorded=False, plant_each=True)


@pytest.mark.parametrize(
    ("name", "leader", "ahead_ns", "is_off"),
    [
        ("plant_r2", PACED, 3_000_000, True),
        ("plant_r2", PACED, -3_000_000, True),
        ("plant_r2", PACED, 900_000, False),
        ("plant_r2", about("plant_r1"), 3_000_000, False),  # in lock-step nobody goes by it
        ("r2", PACED, 3_000_000, False),
    ],
)
def test_the_clocks_of_plants_that_pace_robots_differ_by_a_millisecond_at_most(
    name: str, leader: About, ahead_ns: int, is_off: bool
) -> None:
    """Whatever the doctor's own clock shows."""
    off_ns = 10**18 + 50_000_000
    led, said = replace(leader, wall_ns=off_ns), about(name, wall_ns=off_ns + ahead_ns)
    answers = {item.name: [answer(item, 500_000)] for item in (led, said)}
    (member,) = (member for member in EACH if member.name == name)
    found = diagnose(member, view(answers=answers, norm=TeamNorm(leader)))
    assert ("clock-off" in [item.code for item in found]) == is_off


def test_who_does_not_get_real_time_scheduling_is_told() -> None:
    assert of_r2(scheduling="refused") == [("ready", GOOD), ("not-realtime", BAD)]
    assert of_r2(scheduling="ordinary") == of_r2(scheduling="realtime") == [("ready", GOOD)]


def test_two_of_a_name_are_told_with_their_places() -> None:
    other = about("r2", host="laptop", pid=9, stage="here")
    first, *rest = diagnose(R2, view(*EVERYBODY, other, doubled=frozenset({"r2"})))
    assert (first.code, first.verdict) == ("two-of-a-name", BAD)
    assert first.text == "two processes of this name, lab:7 and laptop:9"
    assert [item.code for item in rest] == ["ready"]
    assert codes(R2, view(SIM, about("r1"), doubled=frozenset({"r2"})))[0][0] == "two-of-a-name"
    late = about("r2", stage="started", pid=9)  # a recorder beside another
    assert codes(R2, view(*EVERYBODY, late)) == [("ready", GOOD)]


def test_the_absent_are_named_together_with_those_of_the_same_reason() -> None:
    others: list[About] = [about("r1", sees=(), stage="warming-up")]
    seen = view(*others, here=frozenset({"r1"}), names=NAMES)
    text = describe_absent([MEMBERS["sim"], R1, R2, MEMBERS["operator"]], seen)
    nobody = "not on the bus: not started, failed, or another bus.endpoint or team.name"
    assert text == f"sim, r2, operator: {nobody}; r1: still warming up"


def test_a_controller_of_ones_own_need_not_answer() -> None:
    foreign = team_members(("r1", "r2"), central=False, recorded=False, foreign=True)
    r2 = next(member for member in foreign if member.name == "r2")
    assert codes(r2, view(SIM, about("r1"), here=NAMES)) == [("foreign", NOTE)]
    absent = view(SIM, about("r1", sees=("sim",)), here=frozenset({"sim", "r1"}))
    assert [verdict for _, verdict in codes(r2, absent)] == [BAD], "but it must be there"


NORM = TeamNorm(SIM, predictor="ab" * 32, planner="r1")


def differences(**changes: Any) -> list[tuple[str, str, str, str]]:
    said = disagreements(about("r2", **changes), NORM)
    return [(item.of, item.got, item.wanted, item.owner) for item in said]


def test_who_agrees_has_no_disagreement() -> None:
    assert differences() == []
    assert differences(predictor="ab" * 32) == []
    assert differences(host="laptop", pid=9, stage="here", scheduling="realtime", sees=()) == []


def test_a_key_that_only_one_has_is_named_and_many_are_counted() -> None:
    config = tuple(f"world.x{i}=1" for i in range(5))
    ((_, got, wanted, _),) = differences(config=config)
    assert got == "team.name unknown, world.mode unknown, world.seed unknown and 5 more"
    assert wanted == 'team.name "team", world.mode "lockstep", world.seed 5 and 5 more'


def test_a_topic_whose_messages_have_another_form_is_named_and_one_of_a_plugin_is_none() -> None:
    said = ("state 5c", "command 00", "wind 11")
    assert differences(messages=said) == [("messages", "command 00", "command 3f", "sim")]
    with pytest.raises(BusError, match="messages of r2 in team 'team': got command 00"):
        refuse("r2", "team", disagreements(about("r2", messages=said), NORM))


def test_predictors_are_compared_with_the_first_that_plans_where_both_have_one() -> None:
    assert differences(predictor="cd" * 32) == [("predictor", "cd" * 6, "ab" * 6, "r1")]
    assert disagreements(about("r2", predictor="cd" * 32), TeamNorm(SIM)) == ()


def test_of_another_version_nothing_else_is_compared() -> None:
    assert differences(version="0.2.0", config=(), predictor="cd" * 32) == [
        ("version", "0.2.0", "0.1.0", "sim")
    ]
    assert differences(version="") == [("version", "not installed", "0.1.0", "sim")]


def test_other_code_or_libraries_are_no_reason_to_refuse() -> None:
    said = disagreements(about("r2", code="fe" * 8, libraries=("python 3.12.1",)), NORM)
    assert [item.of for item in said] == ["code", "libraries"]
    assert said[1].got == "numpy unknown, python 3.12.1"
    refuse("r2", "team", said)


def test_a_refusal_names_what_differs() -> None:
    config = (*SIM.config[:1], "world.seed=4", SIM.config[2])
    with pytest.raises(BusError) as caught:
        refuse("r2", "team", disagreements(about("r2", code="other", config=config), NORM))
    assert str(caught.value).startswith(
        "configuration of r2 in team 'team': got world.seed 4, "
        "expected world.seed 5 as sim has it (all processes"
    )
