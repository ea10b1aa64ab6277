"""In what a process differs from the others, and which of it no team walks with."""

from __future__ import annotations

from typing import Any

import pytest

from quadriga.shared.bus.agreement import TeamNorm, disagreements, refuse
from quadriga.shared.errors import BusError
from tests.shared.bus.abouts import SIM, about

NORM = TeamNorm(SIM, predictor="ab" * 32, planner="r1")


def found(**changes: Any) -> list[tuple[str, str, str, str]]:
    said = disagreements(about("r2", **changes), NORM)
    return [(item.of, item.got, item.wanted, item.owner) for item in said]


def test_who_agrees_has_no_disagreement() -> None:
    assert found() == []
    assert found(predictor="ab" * 32) == []
    assert found(host="laptop", pid=9, stage="here", scheduling="realtime", sees=()) == []


def test_each_key_that_differs_is_named_with_both_values() -> None:
    config = ('team.name="team"', "world.seed=4", 'world.mode="realtime"')
    assert found(config=config) == [
        (
            "configuration",
            'world.mode "realtime", world.seed 4',
            'world.mode "lockstep", world.seed 5',
            "sim",
        )
    ]


def test_a_key_that_only_one_has_is_named_and_many_are_counted() -> None:
    config = tuple(f"world.x{i}=1" for i in range(5))
    ((_, got, wanted, _),) = found(config=config)
    assert got == "team.name unknown, world.mode unknown, world.seed unknown and 5 more"
    assert wanted == 'team.name "team", world.mode "lockstep", world.seed 5 and 5 more'


def test_a_topic_whose_messages_have_another_form_is_named_and_one_of_a_plugin_is_none() -> None:
    said = ("state 5c", "command 00", "wind 11")
    assert found(messages=said) == [("messages", "command 00", "command 3f", "sim")]
    with pytest.raises(BusError, match="messages of r2 in team 'team': got command 00"):
        refuse("r2", "team", disagreements(about("r2", messages=said), NORM))


def test_predictors_are_compared_with_the_first_that_plans_where_both_have_one() -> None:
    assert found(predictor="cd" * 32) == [("predictor", "cd" * 6, "ab" * 6, "r1")]
    assert disagreements(about("r2", predictor="cd" * 32), TeamNorm(SIM)) == ()


def test_of_another_version_nothing_else_is_compared() -> None:
    assert found(version="0.2.0", config=(), predictor="cd" * 32) == [
        ("version", "0.2.0", "0.1.0", "sim")
    ]
    assert found(version="") == [("version", "not installed", "0.1.0", "sim")]


def test_other_code_or_libraries_are_no_reason_to_refuse() -> None:
    said = disagreements(about("r2", code="fe" * 8, libraries=("python 3.12.1",)), NORM)
    assert [item.of for item in said] == ["code", "libraries"]
    assert said[1].got == "numpy unknown, python 3.12.1"
    refuse("r2", "team", said)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"config": (*SIM.config[:1], "world.seed=4", SIM.config[2])},
            "configuration of r2 in team 'team': got world.seed 4, "
            "expected world.seed 5 as sim has it (all processes",
        ),
        ({"version": "9"}, "version of r2 in team 'team': got 9, expected 0.1.0 as sim has it"),
        ({"predictor": "cd" * 32}, "predictor of r2 in team 'team': got cdcdcdcdcdcd, expected ab"),
    ],
)
def test_a_refusal_names_what_differs(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(BusError) as caught:
        refuse("r2", "team", disagreements(about("r2", code="other", **changes), NORM))
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)
