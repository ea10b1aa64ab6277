"""What a team is to keep to when something goes wrong, and whether published walks have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from quadriga.faults.table import with_result
from quadriga.shared.bus.settings import LEASE_MS
from quadriga.shared.config.sections import Config
from quadriga.tables import NOTHING, Table

_SEEN_MS: Final = 100  # from a kill, or from when a silence counts, until it is noticed


class FaultGoal(NamedTuple):
    """One goal.

    Attributes:
        what: in words.
        faults: of which it is asked.
        figure: the field of a row that it is about.
        most: what that may be, of a team's configuration.
    """

    what: str
    faults: tuple[str, ...]
    figure: str
    most: Callable[[Config], int]


GOALS: Final = (
    FaultGoal("a kill of an agent is noticed", ("agent-killed",), "detect_ms", lambda _: _SEEN_MS),
    FaultGoal("a kill of the world is noticed", ("sim-killed",), "detect_ms", lambda _: _SEEN_MS),
    FaultGoal(
        "a kill of the router is noticed", ("router-killed",), "detect_ms", lambda _: _SEEN_MS
    ),
    FaultGoal(
        "a frozen agent is noticed, from its command_damp_ms on",
        ("agent-frozen",),
        "detect_ms",
        lambda config: config.world.command_damp_ms + _SEEN_MS,
    ),
    FaultGoal(
        "a frozen world is noticed, from the lease of a link on",
        ("sim-frozen",),
        "detect_ms",
        lambda _: LEASE_MS + _SEEN_MS,
    ),
)


def build_goal_table(config: Config, rows: Sequence[dict[str, Any]]) -> Table:
    """Each goal with the worst of what came of it.

    Args:
        config: of the walks.
        rows: of all faults.
    """
    found = with_result(rows)
    fell = sum(row["falls_of_others"] for row in found)
    own = sum(len(row["falls"]) for row in found) - fell
    lines = [
        _line("robots fall that the fault was not of", len(found), fell, 0),
        _line("the robot of the fault falls", len(found), own, 0),
    ]
    for goal in GOALS:
        tries = [row for row in found if row["fault"] in goal.faults]
        if tries:
            values = [row[goal.figure] for row in tries]
            worst = None if None in values else max(values)
            lines.append(_line(f"{goal.what}, ms", len(tries), worst, goal.most(config)))
    return Table("Goals", ("goal", "tries", "worst", "at most", "reached"), tuple(lines))


def _line(what: str, tries: int, worst: int | None, most: int) -> tuple[str, ...]:
    reached = worst is not None and worst <= most
    shown = NOTHING if worst is None else str(worst)
    return what, str(tries), shown, str(most), "yes" if reached else "no"
