"""The table a user sees at the end of a walk."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from shared.robot import OUTPUTS

# Unit and factor of each output's errors.
_ERRORS = {
    "z": ("mm", 1e3), "vx": ("m/s", 1.0), "vy": ("m/s", 1.0),
    "roll": ("rad", 1.0), "pitch": ("rad", 1.0), "wz": ("rad/s", 1.0),
}  # fmt: skip


def print_table(summary: dict[str, Any], console: Console) -> None:
    """Show the figures of `quadriga.summary.summarise`."""
    table = Table(show_header=False, title=_title(summary), title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, text in _rows(summary):
        table.add_row(name, text)
    console.print(table)


def _title(summary: dict[str, Any]) -> str:
    robots = summary["robots"]
    team = f"{robots} yoked robots" if robots > 1 else "1 robot"
    return f"{team}, {summary['terrain']}, seed {summary['seed']}, {summary['mode']}"


def _rows(s: dict[str, Any]) -> list[tuple[str, str]]:
    fallen = ", ".join(s["fallen"])
    rows = [
        ("falls", f"[red]{escape(fallen)}[/red]" if fallen else "none"),
        ("distance", f"{_text(s['distance'], '.2f')} m in {s['duration']:.1f} s"),
        ("mean speed", f"vx {_text(s['mean_vx'], '+.3f')}, vy {_text(s['mean_vy'], '+.3f')} m/s, "
                       f"wz {_text(s['mean_wz'], '+.3f')} rad/s"),
        (f"RMSE from {s['steady_from']:.1f} s", _errors(s["rmse"])),
        (f"estimator ({s['estimator']}) RMSE", _errors(s["estimator_rmse"])),
        ("yoke drift", f"at most {_text(s['yoke_drift_max'], '.2f', 1e3)} mm"),
        ("planner", _planner(s)),
        ("control tick", _times(s, "tick_us", "µs", ".0f")),
        ("real-time factor", _text(s["real_time_factor"], ".2f")),
        ("messages", f"{s['messages']:,} recorded, {s['gaps']} gaps, {s['invalid']} invalid"),
    ]  # fmt: skip
    if counted := _counted(s["counters"]):
        rows.append(("counted by the agents", escape(counted)))
    if s["end"]:
        rows.append(("end", escape(s["end"])))
    rows += [(f"{robot} stopped", escape(reason)) for robot, reason in s["stop_reasons"].items()]
    if s["cut"]:
        rows.append(("recording", f"[red]{escape(s['cut'])}[/red]"))
    return rows


def _counted(counters: dict[str, dict[str, int]]) -> str:
    """Sums over the robots of what their last statuses count."""
    total = sum((Counter(counts) for counts in counters.values()), Counter[str]())
    return ", ".join(f"{name} {count:,}" for name, count in sorted(total.items()))


def _planner(s: dict[str, Any]) -> str:
    if not s["planner_solves"]:
        return f"{s['planner']}, no solves"
    return f"{s['planner']}, {_times(s, 'planner_ms', 'ms', '.2f')}"


def _errors(rmse: dict[str, float | None]) -> str:
    parts = []
    for name in OUTPUTS:
        unit, factor = _ERRORS[name]
        digits = ".1f" if factor > 1.0 else ".4f"
        parts.append(f"{name} {_text(rmse[name], digits, factor)} {unit}")
    half = len(parts) // 2
    return ", ".join(parts[:half]) + "\n" + ", ".join(parts[half:])


def _times(s: dict[str, Any], name: str, unit: str, digits: str) -> str:
    median, p99 = s[f"{name}_median"], s[f"{name}_p99"]
    return f"median {_text(median, digits)} {unit}, p99 {_text(p99, digits)} {unit}"


def _text(value: float | None, digits: str, factor: float = 1.0) -> str:
    return "–" if value is None else format(value * factor, digits)
