"""The table of processes: who belongs to a team, and what the command line makes of each row."""

from __future__ import annotations

import pytest

from quadriga.commands.parser import build_parser
from quadriga.shared.members import (
    LAST,
    RECORDER,
    ROLES,
    SIM,
    Role,
    has_lead,
    plant_name,
    team_members,
)

ROBOTS = ("r1", "r2")


@pytest.mark.parametrize(("central", "recorded"), [(False, True), (True, False)])
def test_a_team_has_what_its_configuration_asks_for(central: bool, recorded: bool) -> None:
    names = [m.name for m in team_members(ROBOTS, central=central, recorded=recorded)]
    planner, recorder = ["planner"] * central, ["recorder"] * recorded
    assert names == ["sim", "r1", "r2", *planner, "operator", *recorder]


def test_each_robot_may_have_a_plant_of_its_own() -> None:
    team = team_members(ROBOTS, central=False, recorded=False, plant_each=True)
    assert [(m.name, m.role.name, m.robot) for m in team] == [
        ("plant_r1", "sim", "r1"),
        ("plant_r2", "sim", "r2"),
        ("r1", "agent", "r1"),
        ("r2", "agent", "r2"),
        ("operator", "operator", ""),
    ]


@pytest.mark.parametrize(("robots", "each"), [(1, True), (3, True), (3, False)])
def test_one_process_drives_time(robots: int, each: bool) -> None:
    names = [f"r{i + 1}" for i in range(robots)]
    team = team_members(names, central=True, recorded=True, plant_each=each)
    assert [m.name for m in team if has_lead([m.name])] == [plant_name("r1" if each else "")]


def test_the_plant_comes_first_and_the_recorder_hears_all_others_to_the_end() -> None:
    assert (ROLES[0].name, LAST) == (SIM, RECORDER)
    assert len({role.name for role in ROLES}) == len(ROLES)


@pytest.mark.parametrize("role", ROLES, ids=lambda role: role.name)
def test_every_role_is_a_subcommand(role: Role) -> None:
    robot = ["--robot", "r1"] if role.per_robot else []
    arguments = build_parser().parse_args([role.command, *robot, "--parent", "1"])
    assert hasattr(arguments, "predictor") == role.predicts
