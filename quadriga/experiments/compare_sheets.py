"""The tables of a comparison: one for each scenario, a row for each planner with its predictor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from quadriga.experiments.trial.trial import Figures, TrialResult
from quadriga.shared.robot.a1 import OUTPUTS
from quadriga.tables import LABELS, NOTHING, Table, format_number, format_output

_BASELINE: Final = "none"  # the planner whose cost in the same worlds others' are compared with


def comparison_sheets(rows: Sequence[TrialResult]) -> list[Table]:
    """A table for each scenario, means over the seeds."""
    return [
        _sheet(scenario, [row for row in rows if row.trial.scenario == scenario])
        for scenario in dict.fromkeys(row.trial.scenario for row in rows)
    ]


def label(row: TrialResult) -> str:
    """What a row compares: a planner, and the predictor it plans with."""
    trial = row.trial
    return f"{trial.planner} · {trial.predictor}" if trial.predictor else trial.planner


def _sheet(scenario: str, rows: Sequence[TrialResult]) -> Table:
    columns = (
        "planner · predictor", "fell", "mean vx", *LABELS, "cost", f"/ {_BASELINE}",
        "plan [ms]", "p99", "plans",
    )  # fmt: skip
    groups = {name: [r for r in rows if label(r) == name] for name in map(label, rows)}
    baseline = {
        row.trial.seed: row.walked.cost
        for row in rows
        if row.trial.planner == _BASELINE and row.walked and row.walked.cost
    }
    cells = tuple(_cells(name, group, baseline, len(columns)) for name, group in groups.items())
    seeds = sorted({row.trial.seed for row in rows})
    notes = [
        f"Worlds of seeds {', '.join(map(str, seeds))}. RMSE, mean vx [m/s] and cost: "
        f"steady part, means over the walks without a fall. Cost: mean of ‖y−y_des‖²_Q + "
        f"‖u−u_nominal‖²_R per sample and robot, and over that of the planner "
        f"'{_BASELINE}' in the same worlds. Plan times depend on the machine's load.",
        *(f"{name}: refused: {g[0].refused}." for name, g in groups.items() if g[0].refused),
        *_failures(rows),
    ]
    return Table(f"Closed loop, {scenario}", columns, cells, notes)


def _cells(
    name: str, rows: Sequence[TrialResult], baseline: dict[int, float], width: int
) -> tuple[str, ...]:
    if all(row.refused for row in rows):
        return (name, "refused", *(NOTHING,) * (width - 2))
    found = [row.figures for row in rows if row.figures]
    upright = [row.walked for row in rows if row.walked]
    ratios = [
        row.walked.cost / baseline[row.trial.seed]
        for row in rows
        if row.walked and row.walked.cost is not None and row.trial.seed in baseline
    ]
    plans = sum((Counter(f.plans) for f in found), Counter[str]())
    failed = sum(bool(row.failed) for row in rows)
    return (
        name,
        _falls(found, failed),
        format_number(_mean([f.mean["vx"] for f in upright]), ".3f"),
        *(format_output(key, _mean([f.rmse[key] for f in upright])) for key in OUTPUTS),
        format_number(_mean([f.cost for f in upright]), ".0f"),
        format_number(_mean(ratios), ".2f"),
        format_number(_mean([f.planner_ms_median for f in found]), ".2f"),
        format_number(_mean([f.planner_ms_p99 for f in found]), ".2f"),
        _shares(plans),
    )


def _falls(found: Sequence[Figures], failed: int) -> str:
    fallen = sum(bool(f.fallen) for f in found)
    stopped = sum(bool(f.stopped) and not f.fallen for f in found)
    more = [
        f"{count} {what}" for count, what in ((stopped, "stopped"), (failed, "failed")) if count
    ]
    return ", ".join([f"{fallen}/{len(found) + failed}", *more])


def _failures(rows: Sequence[TrialResult]) -> list[str]:
    """Who fell or stopped when and why, and what failed, a line for each walk."""
    lines = []
    for row in rows:
        if row.failed:
            lines.append(f"{label(row)}, seed {row.trial.seed}: failed: {row.failed}.")
        if row.figures is None or row.walked:
            continue
        fell = [f"{robot} fell at {s:.2f} s" for robot, s in row.figures.fallen.items()]
        told = [f"{robot} stopped: {why}" for robot, why in row.figures.stopped.items()]
        lines.append(f"{label(row)}, seed {row.trial.seed}: {', '.join(fell + told)}.")
    return lines


def _shares(plans: Counter[str]) -> str:
    """Shares of the plans' statuses, most frequent first."""
    total = plans.total()
    return ", ".join(f"{s} {100 * k / total:.3g} %" for s, k in plans.most_common()) or NOTHING


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
