"""Rows of walks on the desk, summed up: the walks themselves, and what came of faults."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from rich.table import Table

from quadriga.desk.faults import BY_NAME, NO_FAULT
from quadriga.desk.trial import WITHOUT

# Figure, its name, its factor and digits.
_FIGURES: Final = (
    ("vx", "vx m/s", 1.0, 3),
    ("vy_rms", "vy mm/s", 1e3, 1),
    ("wz_rms", "yaw rate mrad/s", 1e3, 1),
    ("roll_rms", "roll mrad", 1e3, 2),
    ("pitch_rms", "pitch mrad", 1e3, 2),
)
_MISSING: Final = "-"


def build_walk_table(rows: Sequence[dict[str, Any]]) -> Table:
    """Walks in which nothing went wrong, beside the same without bridges: means over robots.

    The time from a report to the command made of it is the median of the walks' medians and the
    worst of their p99 and maxima; without bridges the command's age, in whole milliseconds. A
    command is late if it is of an earlier tick than the one at which the motors follow it.
    """
    table = Table(title="walks", title_justify="left")
    headings = ["through", "walks", "no walk", "falls", "stops"]
    headings += [name for _, name, _, _ in _FIGURES]
    for name in (*headings, "answer ms p50", "p99", "max", "late %"):
        table.add_column(name, justify="left" if name == "through" else "right")
    for kind, title in ((NO_FAULT.name, "bridges"), (WITHOUT, "no bridges")):
        every = [row for row in rows if row["fault"] == kind]
        found = [row for row in every if "error" not in row]
        if not every:
            continue
        cells = [title, str(len(every)), str(len(every) - len(found))]
        cells += [str(sum(bool(row["fell"]) for row in found)), str(sum(map(_has_stopped, found)))]
        cells += [_mean(found, name, factor, digits) for name, _, factor, digits in _FIGURES]
        table.add_row(*cells, *_ages(found))
    return table


def _has_stopped(row: dict[str, Any]) -> bool:
    """Whether a bridge or an agent stopped its robot before the end."""
    bridges = [mode for said in row.get("said", {}).values() for mode in said]
    return any(row["agents"].values()) or any(mode.startswith("stopped") for mode in bridges)


def _mean(rows: Sequence[dict[str, Any]], name: str, factor: float, digits: int) -> str:
    values = [f[name] for row in rows for f in row["figures"].values() if name in f]
    return f"{factor * np.mean(values):.{digits}f}" if values else _MISSING


def _ages(rows: Sequence[dict[str, Any]]) -> list[str]:
    late = [ages for row in rows for ages in row["late"].values()]
    if not late:
        return [_MISSING] * 4
    kind = "answer" if all("answer.median" in ages for ages in late) else "command"
    return [
        f"{np.median([ages[f'{kind}.median'] for ages in late]):.2f}",
        *(f"{max(ages[f'{kind}.{name}'] for ages in late):.2f}" for name in ("p99", "max")),
        f"{100 * np.mean([ages['share'] for ages in late]):.1f}",
    ]


def build_fault_table(rows: Sequence[dict[str, Any]]) -> Table:
    """For each fault: tries, falls, and how long its robot took to be damped."""
    table = Table(title="faults", title_justify="left")
    headings = ("fault", "tries", "no walk", "its robot fell", "others fell", "came to rest")
    for name in (*headings, "ms p50", "max", "what its bridge said"):
        table.add_column(name, justify="right" if name not in (headings[0],) else "left")
    for name in BY_NAME:
        every = [row for row in rows if row["fault"] == name]
        found = [row for row in every if "error" not in row]
        if not every:
            continue
        rest = [row["rest_ms"][row["robot"]] for row in found]
        times = [ms for ms in rest if ms is not None]
        table.add_row(
            name,
            str(len(every)),
            str(len(every) - len(found)),
            str(sum(row["robot"] in row["fell"] for row in found)),
            str(sum(len(set(row["fell"]) - {row["robot"]}) for row in found)),
            str(len(times)),
            f"{np.median(times):.0f}" if times else _MISSING,
            f"{max(times)}" if times else _MISSING,
            _most_said(found),
        )
    return table


def _most_said(rows: Sequence[dict[str, Any]]) -> str:
    """The mode and the code of the reason that most bridges ended with, and how many did."""
    words = [row["said"][row["robot"]] for row in rows]
    last = [said[-1].partition(":")[0] if said else "nothing" for said in words]
    if not last:
        return _MISSING
    text = max(set(last), key=last.count)
    return f"{text} ({last.count(text)})"
