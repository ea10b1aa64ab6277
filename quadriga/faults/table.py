"""Rows of walks with faults, summed up: a line for each fault, of what came and what was said."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from quadriga.faults.catalogue import BY_NAME
from quadriga.shared.codes import TIME_OVER, code_of
from quadriga.tables import NOTHING, Table

_COLUMNS: Final = (
    *("fault", "mode", "tries", "void", "fell"),
    *("noticed ms", "stood ms", "again ms", "lost"),
)
_NOTE: Final = """\
"void": tries without a result; "fell": other robots than the one of the fault, and that one. Of
times, and of messages lost, the median and the largest of all other tries. "noticed": from the
fault until an agent no longer walked, the world said that a robot is silent or gone, or the first
process missed the world; "stood": until all others stood or were damped; "again": until all robots
walked for good, 0 if none had stopped. "lost": what the recording lacks, the faulty robot's own
aside; in real time also commands of ticks that an agent did not answer."""
_SAID_COLUMNS: Final = ("fault", "walked on", "stopped", "fell", "status", "doctor")
_SAID_NOTE: Final = """\
"walked on": all robots walked when the time was over; "stopped": somebody stopped
by the world, and nobody fell. "status": why most robots no longer walked; "doctor": what `quadriga
doctor` found wrong with most processes 1 s after the fault, in real time."""
_MODES: Final = {"lockstep": "lock", "realtime": "real"}

_Rows = Sequence[dict[str, Any]]


def build_team_fault_tables(rows: _Rows) -> tuple[Table, Table]:
    """For each fault: how soon it was noticed and what was lost; what became of the team."""
    names = dict.fromkeys([*BY_NAME, *(row["fault"] for row in rows)])
    found = [(name, [row for row in rows if row["fault"] == name]) for name in names]
    found = [(name, tries) for name, tries in found if tries]
    return (
        Table(
            "Faults of a team",
            _COLUMNS,
            tuple((name, *_times(tries)) for name, tries in found),
            [_NOTE],
        ),
        Table(
            "What became of it",
            _SAID_COLUMNS,
            tuple((name, *_words(tries)) for name, tries in found),
            [_SAID_NOTE],
        ),
    )


def with_result(rows: _Rows) -> _Rows:
    """The tries that have come to the fault and have been recorded."""
    return [row for row in rows if "error" not in row]


def _times(every: _Rows) -> list[str]:
    rows = with_result(every)
    return [
        next((_MODES[row["mode"]] for row in rows), NOTHING),
        str(len(every)),
        str(len(every) - len(rows)),
        f"{sum(row['falls_of_others'] for row in rows)}/{sum(map(_has_own_fallen, rows))}",
        *(_median_and_most(row[name] for row in rows) for name in _FIGURES),
    ]


_FIGURES: Final = ("detect_ms", "stand_ms", "recover_ms", "lost_messages")


def _median_and_most(values: Iterable[int | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{np.median(known):.0f}/{max(known)}" if known else NOTHING


def _words(every: _Rows) -> list[str]:
    rows = with_result(every)
    walked, fell = sum(map(_has_walked_on, rows)), sum(bool(row["falls"]) for row in rows)
    said = (what.partition(" ")[2] for row in rows for what in row["status"].values())
    doctors = (
        f"{name if name in ('sim', 'operator', 'recorder', 'link') else 'agent'}: {what}"
        for row in rows
        for name, what in row.get("doctor", {}).items()
    )
    return [
        str(walked),
        str(len(rows) - walked - fell),
        str(fell),
        _most_frequent(code_of(reason) for reason in said if reason),
        _most_frequent(doctors),
    ]


def _has_own_fallen(row: dict[str, Any]) -> bool:
    return row["robot"] in row["falls"]


def _has_walked_on(row: dict[str, Any]) -> bool:
    walks = all(what == "walk" for what in row["status"].values())
    stopped = row["falls"] or row["lost"]
    return walks and not stopped and code_of(row["end"]) == TIME_OVER


def _most_frequent(words: Iterable[str]) -> str:
    for word, times in Counter(words).most_common(1):
        return f"{word} ({times})"
    return NOTHING
