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
    TeamView,
    describe_absent,
    diagnose,
    disagreements,
    members,
    refuse,
)
from quadriga.shared.config.load import load
from quadriga.shared.errors import BusError
from quadriga.shared.members import Member, team_members
from quadriga.shared.runtime.places import SOURCE
from tests.shared.bus.abouts import NAMES, SIM, about, answer, view

DOC = (SOURCE / "docs" / "doctor.md").read_text(encoding="utf-8")
MEMBERS = {m.name: m for m in team_members(("r1", "r2"), central=False, recorded=False)}
R2 = MEMBERS["r2"]
EVERYBODY = (SIM, about("r1", predictor="ab" * 32), about("r2"))
WELL = [("ready", GOOD)]


def codes(member: Member, seen: TeamView) -> list[tuple[str, str]]:
    """What is found, each code of which is in the manual."""
    found = diagnose(member, seen)
    assert {item.code for item in found if f"`{item.code}`" not in DOC} == set()
    return [(item.code, item.verdict) for item in found]


def of_r2(**changes: Any) -> list[tuple[str, str]]:
    return codes(R2, view(SIM, about("r1"), about("r2", **changes)))


def test_members() -> None:
    one = {"sim", "operator", "r1"}
    assert members(load(None, {"team.robots": 1, "recorder.enabled": False})) == one
    assert members(load(None, {"team.robots": 3})) == {*one, "recorder", "r2", "r3"}


def test_who_is_ready_and_agrees_is_well() -> None:
    for name in NAMES:
        assert codes(MEMBERS[name], view(*EVERYBODY)) == WELL


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
    assert ("`quadriga agent --robot r2`" in item.remedy) == (code == "not-started")


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
    assert of_r2(sees=("sim",)) == [*WELL, ("not-seen", BAD)]
    assert of_r2(sees=(), stage="started") == [("started", NOTE)], "it has not looked yet"


OTHER = tuple(f"world.x{i}=1" for i in range(5))


@pytest.mark.parametrize(
    ("changes", "verdict", "text"),
    [
        ({"version": "9", "config": ()}, BAD, "another version: 9, sim has 0.1.0"),
        ({"version": ""}, BAD, "another version: none, sim has 0.1.0"),
        (
            {"messages": ("state 5c", "command 00")},
            BAD,
            "another messages: command 00, sim has command 3f",
        ),
        (
            {"config": (SIM.config[0], "world.seed=4", SIM.config[2])},
            BAD,
            "another configuration: world.seed=4, sim has world.seed=5",
        ),
        (
            {"config": OTHER},
            BAD,
            "another configuration: world.x0=1, world.x1=1, world.x2=1 and 2 more, sim has "
            'team.name="team", world.mode="lockstep", world.seed=5',
        ),
        ({"predictor": "cd" * 32}, BAD, f"another predictor: {'cd' * 6}, r1 has {'ab' * 6}"),
        ({"code": "fe" * 8}, NOTE, f"another code: {'fe' * 8}, sim has 0123456789abcdef"),
        ({"predictor": "ab" * 32, "host": "laptop", "pid": 9, "stage": "here"}, GOOD, ""),
    ],
)
def test_no_team_walks_with_one_that_differs_but_in_source_files(
    changes: dict[str, Any], verdict: str, text: str
) -> None:
    """Of another version nothing else is compared."""
    said, seen = about("r2", **changes), view(*EVERYBODY)
    found = [*disagreements(said, seen)]
    assert [(item.verdict, item.text) for item in found] == [(verdict, text)] * bool(text)
    assert [
        item for item in diagnose(R2, view(*EVERYBODY[:2], said)) if item.code.startswith("other-")
    ] == found
    assert all(f"`{item.code}`" in DOC for item in found)
    assert not [*disagreements(said, replace(seen, lead=None))], "nobody knows what is right"
    if verdict == BAD:
        with pytest.raises(BusError, match=r"r2 of team 'team': got another .* \(.+\)"):
            refuse("r2", "team", found)
    else:
        refuse("r2", "team", found)


@pytest.mark.parametrize(
    ("ahead_ns", "took_ns", "text"),
    [
        (90_000_000, 0, ""),
        (3_000_000_000, 10**6, "its system clock is 3,000.0 ms ahead of this computer's"),
        (-300_000_000, 10**6, "its system clock is 300.0 ms behind this computer's"),
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
    found = diagnose(member, view(answers=answers, lead=leader))
    assert ("clock-off" in [item.code for item in found]) == is_off


def test_two_of_a_name_are_told_with_their_places() -> None:
    other = about("r2", host="laptop", pid=9, stage="here")
    first, *rest = diagnose(R2, view(*EVERYBODY, other, doubled=frozenset({"r2"})))
    assert (first.code, first.verdict) == ("two-of-a-name", BAD)
    assert first.text == "two processes of this name, lab:7 and laptop:9"
    assert [item.code for item in rest] == ["ready"]
    assert codes(R2, view(SIM, about("r1"), doubled=frozenset({"r2"})))[0][0] == "two-of-a-name"
    late = about("r2", stage="started", pid=9)  # a recorder beside another
    assert codes(R2, view(*EVERYBODY, late)) == WELL


def test_the_absent_are_named_together_with_those_of_the_same_reason() -> None:
    seen = view(about("r1", sees=(), stage="warming-up"), here=frozenset({"r1"}))
    text = describe_absent([MEMBERS[name] for name in ("sim", "r1", "r2", "operator")], seen)
    nobody = "not on the bus: not started, failed, or another bus.endpoint or team.name"
    assert text == f"sim, r2, operator: {nobody}; r1: still warming up"


def test_a_controller_of_ones_own_need_not_answer() -> None:
    r2 = replace(R2, foreign=True)
    assert codes(r2, view(SIM, about("r1"), here=NAMES)) == [("foreign", NOTE)]
    absent = view(SIM, about("r1", sees=("sim",)), here=frozenset({"sim", "r1"}))
    assert [verdict for _, verdict in codes(r2, absent)] == [BAD], "but it must be there"
