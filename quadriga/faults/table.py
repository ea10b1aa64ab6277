"""Rows of walks with faults, summed up: a line for each fault."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from quadriga.faults.catalogue import BY_NAME
from quadriga.shared.wire.codes import TIME_OVER, code_of
from quadriga.tables import NOTHING, Table

_COLUMNS: Final = (
    *("fault", "tries", "no result", "walked on", "stopped", "falls", "falls of others"),
    *("noticed ms p50", "max", "others stood ms p50", "max", "lost messages"),
    *("forged", "refused", "passed", "most frequent reason"),
)
_NOTE: Final = """\
"walked on": all robots walked until the time was over; "stopped": somebody stopped, or was led down
by the world, and nobody fell.
"noticed": from the fault until an agent no longer walked or the world said that a robot is silent
or gone; "others stood": until all other robots stood or were damped. Falls and times are of the
tries with a result. "lost messages": what the recordings lack, the faulty robot's own aside; in
real time also commands of ticks that an agent did not answer.
"forged": messages and connections of an attacker; "refused": by the router, which has told it, or
since nobody can read it; "passed": what came through and can be read."""


def build_team_fault_table(rows: Sequence[dict[str, Any]]) -> Table:
    """For each fault: tries, what became of the team, how soon it was noticed."""
    lines = [
        (name, *_cells([row for row in rows if row["fault"] == name]))
        for name in BY_NAME
        if any(row["fault"] == name for row in rows)
    ]
    return Table("Faults of a team", _COLUMNS, tuple(lines), [_NOTE])


def _cells(every: Sequence[dict[str, Any]]) -> list[str]:
    found = [row for row in every if "error" not in row]
    walked = [row for row in found if _has_walked_on(row)]
    fell = [row for row in found if row["falls"]]
    reasons = Counter(reason for row in found for reason in _reasons(row)).most_common(1)
    return [
        str(len(every)),
        str(len(every) - len(found)),
        str(len(walked)),
        str(len(found) - len(walked) - len(fell)),
        str(len(fell)),
        str(sum(row["falls_of_others"] for row in found)),
        *_times(found, "detect_ms"),
        *_times(found, "stand_ms"),
        str(sum(row["lost_messages"] for row in found)),
        *_attack(found),
        *(f"{reason} ({times})" for reason, times in reasons or [(NOTHING, 0)]),
    ]


def _has_walked_on(row: dict[str, Any]) -> bool:
    walks = all(what == "walk" for what in row["status"].values())
    stopped = row["falls"] or row["lowered"]
    return walks and not stopped and code_of(row["end"]) == TIME_OVER


def _reasons(row: dict[str, Any]) -> list[str]:
    """Codes of the reasons for which agents no longer walked."""
    reasons = (what.partition(" ")[2] for what in row["status"].values())
    return [code_of(reason) for reason in reasons if reason]


def _attack(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What attackers have tried, and what came of it."""
    attacked = [row for row in rows if "forged" in row]
    names = ("forged", "refused", "passed")
    return [str(sum(row[name] for row in attacked)) if attacked else NOTHING for name in names]


def _times(rows: Sequence[dict[str, Any]], name: str) -> list[str]:
    times = [row[name] for row in rows if row[name] is not None]
    return [f"{np.median(times):.0f}", str(max(times))] if times else [NOTHING] * 2
