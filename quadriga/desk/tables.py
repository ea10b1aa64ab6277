"""Rows of walks on the desk, summed up: the walks themselves, and what came of faults."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from quadriga.desk.faults import BY_NAME, NO_FAULT
from quadriga.desk.trial import WITHOUT
from quadriga.shared.codes import TIME_OVER, code_of
from quadriga.tables import NOTHING, Table

# Figure, its name, its factor and digits.
_FIGURES: Final = (
    ("vx", "vx m/s", 1.0, 3),
    ("vy_rms", "vy mm/s", 1e3, 1),
    ("wz_rms", "yaw rate mrad/s", 1e3, 1),
    ("roll_rms", "roll mrad", 1e3, 2),
    ("pitch_rms", "pitch mrad", 1e3, 2),
)
WALKED_ON, LAY_DOWN, DAMPED, DRIVEN = "walked on", "lay down", "damped", "still driven"
_STOPPED: Final = "estop"
ENOUGH: Final = 0.99  # share of real time that simulated robots must keep to be like real ones


def build_walk_table(rows: Sequence[dict[str, Any]], name: str = "") -> Table:
    """Walks in which nothing went wrong, beside the same without bridges: means over robots.

    The time from a report to the command made of it is the median of the walks' medians and the
    worst of their p99 and maxima; without bridges the command's age, in whole milliseconds. A
    command is late if it is of an earlier tick than the one at which the motors follow it. Walks
    for which the computer was too slow are counted, with their falls, and left out of all else.
    """
    columns = ["through", "walks", "no walk", "too slow", "falls", "stops"]
    columns += [name for _, name, _, _ in _FIGURES]
    columns += ["answer ms p50", "p99", "max", "late %"]
    kinds = ((NO_FAULT.name, "bridges"), (WITHOUT, "no bridges"))
    lines = [
        (f"{name}{title}", *_walks([row for row in rows if row["fault"] == kind]))
        for kind, title in kinds
        if any(row["fault"] == kind for row in rows)
    ]
    return Table("walks", tuple(columns), tuple(lines))


def _walks(every: Sequence[dict[str, Any]]) -> list[str]:
    counts, found = _sort_out(every)
    cells = [*counts, str(sum(bool(row["fell"]) for row in found))]
    cells.append(str(sum(map(_has_stopped, found))))
    cells += [_mean(found, name, factor, digits) for name, _, factor, digits in _FIGURES]
    return [*cells, *_ages(found)]


def _sort_out(every: Sequence[dict[str, Any]]) -> tuple[list[str], list[dict[str, Any]]]:
    """How many rows there are, how many are no walk or of a slow computer; and the others."""
    walks = [row for row in every if "error" not in row]
    slow = [row for row in walks if is_too_slow(row)]
    fell = sum(bool(row["fell"]) for row in slow)
    counts = [str(len(every)), str(len(every) - len(walks)), str(len(slow))]
    counts[-1] += f" ({fell} fell)" if fell else ""
    return counts, [row for row in walks if not is_too_slow(row)]


def is_too_slow(row: dict[str, Any]) -> bool:
    """Whether the computer was too slow for the simulated robots to be like real ones."""
    return bool(row.get("kept", 1.0) < ENOUGH)


def _has_stopped(row: dict[str, Any]) -> bool:
    """Whether a bridge or an agent stopped its robot before the end."""
    bridges = [mode for said in row.get("said", {}).values() for mode in said]
    return any(row["agents"].values()) or any(mode.startswith(_STOPPED) for mode in bridges)


def _mean(rows: Sequence[dict[str, Any]], name: str, factor: float, digits: int) -> str:
    values = [f[name] for row in rows for f in row["figures"].values() if name in f]
    return f"{factor * np.mean(values):.{digits}f}" if values else NOTHING


def _ages(rows: Sequence[dict[str, Any]]) -> list[str]:
    late = [ages for row in rows for ages in row["late"].values()]
    if not late:
        return [NOTHING] * 4
    kind = "answer" if all("answer.median" in ages for ages in late) else "command"
    return [
        f"{np.median([ages[f'{kind}.median'] for ages in late]):.2f}",
        *(f"{max(ages[f'{kind}.{name}'] for ages in late):.2f}" for name in ("p99", "max")),
        f"{100 * np.mean([ages['share'] for ages in late]):.1f}",
    ]


def build_fault_table(rows: Sequence[dict[str, Any]]) -> Table:
    """For each fault: tries, what became of its robot and of the others, falls.

    The time to damping is that from the fault until the motors of a robot that did not walk on or
    lie down were damped or off.
    """
    columns = (
        *("fault", "tries", "no walk", "too slow", WALKED_ON, LAY_DOWN, DAMPED, DRIVEN, "fell"),
        *("ms to damping p50", "max"),
        *(f"others {what}" for what in (WALKED_ON, LAY_DOWN, DAMPED, "fell")),
        "its bridge's last word",
    )
    lines = [
        (name, *_faults([row for row in rows if row["fault"] == name]))
        for name in BY_NAME
        if any(row["fault"] == name for row in rows)
    ]
    return Table("faults", columns, tuple(lines))


def _faults(every: Sequence[dict[str, Any]]) -> list[str]:
    counts, found = _sort_out(every)
    own = [(row, row["robot"]) for row in found]
    others = [(row, name) for row in found for name in row["said"] if name != row["robot"]]
    outcomes, around = (Counter(outcome_of(*one) for one in robots) for robots in (own, others))
    times = [row["rest_ms"][name] for row, name in own if outcome_of(row, name) == DAMPED]
    words = Counter(_last_word(*one) for one in own).most_common(1)
    return [
        *counts,
        *(str(outcomes[what]) for what in (WALKED_ON, LAY_DOWN, DAMPED, DRIVEN)),
        str(sum(name in row["fell"] for row, name in own)),
        *([f"{np.median(times):.0f}", str(max(times))] if times else [NOTHING] * 2),
        *(str(around[what]) for what in (WALKED_ON, LAY_DOWN, DAMPED)),
        str(sum(name in row["fell"] for row, name in others)),
        *(f"{word} ({times})" for word, times in words or [(NOTHING, 0)]),
    ]


def outcome_of(row: dict[str, Any], robot: str) -> str:
    """What became of a robot once something had gone wrong.

    Args:
        row: of a walk with a fault.
        robot: its name.
    """
    said = row["said"][robot]
    if any(mode.startswith("lying-down") for mode in said):
        return WALKED_ON if code_of(row["end"]) == TIME_OVER else LAY_DOWN
    return DRIVEN if row["rest_ms"][robot] is None else DAMPED


def _last_word(row: dict[str, Any], robot: str) -> str:
    """The mode that its bridge named last, with the code of the reason."""
    said = row["said"][robot]
    return said[-1].partition(":")[0] if said else NOTHING
