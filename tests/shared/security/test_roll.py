"""Who may have a certificate, and which of them are valid."""

from __future__ import annotations

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.shared.security.roll import (
    MOST_VALID,
    common_name,
    format_numbers,
    identity_of,
    read_numbers,
    split_common_name,
    team_roll,
    valid_names,
)

EACH = {"team.plants": "each", "team.yokes": "none"}


def names(**keys: object) -> set[str]:
    given = {name.replace("__", "."): value for name, value in keys.items()}
    return {who.name for who in team_roll(load(None, given))}


def test_everybody_who_may_be_on_the_bus_is_on_the_roll() -> None:
    always = {"operator", "recorder", "planner", "launcher", "estop", "doctor"}
    always |= {"stop", "reset", "resume", "observer", "router"}
    assert names(team__robots=2) == {"sim", "r1", "r2", *always}
    assert names(team__robots=1, **EACH) == {"plant_r1", "r1", *always}


def test_the_roll_does_not_depend_on_how_the_team_plans_or_records() -> None:
    assert names(planner__kind="centralised", recorder__enabled=False) == names()


def test_who_looks_on_has_one_identity_whatever_its_process() -> None:
    assert identity_of("echo-4711") == "observer"
    assert identity_of("plant_r1") == "plant_r1"


@pytest.mark.parametrize("identity", ["r1", "plant_r1", "weather.station"])
def test_a_common_name_is_an_identity_and_a_number(identity: str) -> None:
    assert split_common_name(common_name(identity, 12)) == (identity, 12)
    assert split_common_name(identity.replace(".", "")) == (identity.replace(".", ""), 0)


def test_revoked_numbers_are_not_valid_and_the_next_ones_are() -> None:
    valid = valid_names("r1", 2)
    assert not {"r1.0", "r1.1", "r1.2"} & {*valid}
    assert {"r1.3", f"r1.{2 + MOST_VALID}"} <= {*valid}


def test_numbers_are_read_as_they_are_written() -> None:
    assert read_numbers(format_numbers({"r2": 3, "r1": 0}), "f") == {"r1": 0, "r2": 3}


@pytest.mark.parametrize("text", ["", "[", "[]", '{"r1": "2"}', '{"r1": -1}', '{"r1": true}'])
def test_other_text_is_one_clear_error(text: str) -> None:
    with pytest.raises(ConfigError, match=r"^/x/revoked\.json: got "):
        read_numbers(text, "/x/revoked.json")


def test_a_number_of_thousands_of_digits_is_none() -> None:
    assert split_common_name("r1." + "9" * 5000) == ("r1." + "9" * 5000, 0)
