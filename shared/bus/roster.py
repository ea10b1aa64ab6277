"""Who belongs to a team, by its configuration."""

from __future__ import annotations

from quadriga.shared.config.sections import Config
from quadriga.shared.members import LEADS, PLANNER, Member, team_members
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robot.conventions import robot_names


def processes(config: Config) -> tuple[Member, ...]:
    """All processes of a team, in the order of the table of processes."""
    return team_members(
        robot_names(config.team.robots),
        central=find_kind(config.planner.kind).central,
        recorded=config.recorder.enabled,
        plant_each=config.team.plants == "each",
        foreign=bool(config.team.controller),
    )


def members(config: Config) -> frozenset[str]:
    """Names of all processes of a team."""
    return frozenset(member.name for member in processes(config))


def foreign_members(config: Config) -> frozenset[str]:
    """Names of those that are controllers of one's own."""
    return frozenset(member.name for member in processes(config) if member.foreign)


def lead(config: Config) -> str:
    """Name of the process that drives the team's time, with which all others leave."""
    return next(member.name for member in processes(config) if member.name in LEADS)


def first_predicting(config: Config) -> str:
    """Name of the first process that plans with a predictor; "" if none does."""
    kind = find_kind(config.planner.kind)
    if not kind.needs_predictor:
        return ""
    return PLANNER if kind.central else robot_names(config.team.robots)[0]
