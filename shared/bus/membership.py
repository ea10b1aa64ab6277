"""Who belongs to a team, by its configuration, and who is on the bus, by tokens."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from quadriga.shared.config.sections import Config
from quadriga.shared.members import LEADS, PLANNER, Member, team_members
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names


def processes(config: Config) -> tuple[Member, ...]:
    """All processes of a team, in the order of the table of processes."""
    return team_members(
        robot_names(config.team.robots),
        central=find_kind(config.planner.kind).central,
        recorded=config.recorder.enabled,
        plant_each=config.team.plant_per_robot,
        foreign=bool(config.team.agent_command),
    )


def members(config: Config) -> frozenset[str]:
    """Names of all processes of a team."""
    return frozenset(member.name for member in processes(config))


def lead(config: Config) -> str:
    """Name of the process that drives the team's time, with which all others leave."""
    return next(member.name for member in processes(config) if member.name in LEADS)


def first_predicting(config: Config) -> str:
    """Name of the first process that plans with a predictor; "" if none does."""
    kind = find_kind(config.planner.kind)
    if not kind.needs_predictor:
        return ""
    return PLANNER if kind.central else robot_names(config.team.robots)[0]


class Presence:
    """The tokens of the other processes, `<team>/<name>/<stage>/<session>`.

    Tokens are noted by the thread that receives them and read by another.
    """

    def __init__(self, session: str) -> None:
        """Begin with nobody; `session` is the own one, which is left out."""
        self._own = session
        self._tokens: set[tuple[str, str, str]] = set()  # name, stage, session

    def note(self, key: str, *, there: bool) -> None:
        """A token has been declared, or has vanished."""
        _, name, stage, session = key.split("/")
        if session == self._own:
            return
        if there:
            self._tokens.add((name, stage, session))
        else:
            self._tokens.discard((name, stage, session))

    def at(self, stage: str) -> frozenset[str]:
        """Names of those that are at `stage` now."""
        return frozenset(self._names(stage))

    def duplicates(self, stage: str, own: Iterable[str]) -> frozenset[str]:
        """Names that two processes carry at `stage`; `own` is this one's, if it is there."""
        counts = Counter([*self._names(stage), *own])
        return frozenset(name for name, count in counts.items() if count > 1)

    def _names(self, stage: str) -> list[str]:
        return [name for name, at, _ in self._tokens.copy() if at == stage]
