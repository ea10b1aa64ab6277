"""Which of the teams on this machine is meant, and what files tell of them."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from quadriga.shared.errors import ConfigError
from quadriga.team.running_team import (
    RunningTeam,
    choose_team,
    read_running_team,
    to_json,
    unite_teams,
)

WALK = RunningTeam("team", "tcp/127.1.2.2:7447", "/a/config.toml", "/a", "/", 10, 500)
LAB = replace(WALK, team="lab", config="/b/config.toml", folder="/b", pid=11, started=600)


def test_a_file_is_read_back() -> None:
    assert read_running_team(to_json(WALK)) == WALK


def test_what_a_later_version_adds_is_passed_over() -> None:
    assert read_running_team(json.dumps({**json.loads(to_json(LAB)), "colour": "red"})) == LAB


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "null",
        "{",
        "[" * 30_000,
        to_json(WALK).replace('"pid": 10', '"pid": "10"'),
        to_json(WALK).replace('"pid": 10', '"pid": -1'),
        to_json(WALK).replace('"pid": 10', '"pid": true'),
        to_json(WALK).replace('"team": "team"', '"team": 3'),
        to_json(WALK).replace('"team": "team"', '"team": "\\u001b[2J"'),
        to_json(WALK).replace('"config"', '"konfig"'),
    ],
)
def test_what_is_no_such_file_tells_nothing(text: str) -> None:
    assert read_running_team(text) is None


def test_processes_of_one_team_are_one_team() -> None:
    by_hand = replace(WALK, folder="", config="/run/9.toml", pid=9, started=400)
    assert unite_teams([by_hand, LAB, WALK]) == (WALK, LAB)


def test_the_only_team_is_meant() -> None:
    assert choose_team([]) is None
    assert choose_team([WALK]) is WALK
    assert choose_team([WALK, LAB], "lab") is LAB
    assert choose_team([WALK, LAB], "ghost") is None


@pytest.mark.parametrize(
    ("teams", "wanted", "cause"),
    [
        ([WALK, LAB], "", "(--team team; --team lab)"),
        (
            [WALK, replace(WALK, config="/c/config.toml", pid=12)],
            "team",
            "(--config /a/config.toml; --config /c/config.toml)",
        ),
        ([replace(WALK, config=f"/{n}.toml", pid=n) for n in range(1, 9)], "", "; and 2 more)"),
    ],
)
def test_of_several_one_must_be_chosen(teams: list[RunningTeam], wanted: str, cause: str) -> None:
    with pytest.raises(ConfigError, match=r"that run on this machine, expected the choice") as got:
        choose_team(teams, wanted)
    assert str(got.value).endswith(cause)


def test_names_of_any_length_are_shown_in_part() -> None:
    teams = [replace(WALK, team="a" * 60_000), replace(WALK, team="b" * 60_000)]
    with pytest.raises(ConfigError) as error:
        choose_team(teams)
    assert len(str(error.value)) < 600
