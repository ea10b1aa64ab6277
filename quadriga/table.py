"""The table a user sees at the end of a walk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from quadriga.columns import printable

# Unit and factor of each of `quadriga.traces.ERRORS`.
_ERRORS = {
    "z": ("mm", 1e3), "z-felt": ("mm", 1e3), "vx": ("m/s", 1.0), "vy": ("m/s", 1.0),
    "roll": ("rad", 1.0), "pitch": ("rad", 1.0), "wz": ("rad/s", 1.0),
}  # fmt: skip


def print_table(summary: dict[str, Any], console: Console) -> None:
    """Show the figures of `quadriga.recordings.summary.summarise`."""
    table = Table(show_header=False, title=_title(summary), title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, told in rows(summary):
        text = printable(told)
        marked = f"[red]{escape(text)}[/red]" if _is_bad(name, text) else escape(text)
        table.add_row(name, marked)
    console.print(table)


def _is_bad(name: str, text: str) -> bool:
    return name == "recording" or (name == "falls" and text != "none")


def _title(summary: dict[str, Any]) -> str:
    robots = summary["robots"]
    team = f"{robots} yoked robots" if robots > 1 else "1 robot"
    where = summary["scenario"] or summary["terrain"]
    return f"{team}, {where}, seed {summary['seed']}, {summary['mode']}"


def rows(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and text of each figure that there is."""
    shown = [
        ("falls", ", ".join(s["fallen"]) or "none"),
        *_against_truth(s),
        ("planner", _planner(s)),
        ("control tick", _times(s, "tick_us", "µs", ".0f")),
        *_late(s["realtime"]),
        ("real-time factor", _text(s["real_time_factor"], ".2f")),
        ("messages", f"{s['messages']:,} recorded, {s['gaps']} gaps, {s['invalid']} invalid"),
    ]
    if counted := _counted(s["counters"]):
        shown.append(("counted by the agents", counted))
    if s["end"]:
        shown.append(("end", s["end"]))
    shown += [(f"{robot} stopped", reason) for robot, reason in s["stop_reasons"].items()]
    if s["cut"]:
        shown.append(("recording", s["cut"]))
    return shown


def _late(realtime: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """In real time how late each robot's commands were, and the world itself."""
    if realtime is None:
        return []
    shown = []
    for name, told in realtime.items():
        jitter = _spread("jitter", told["jitter_ms"])
        if name == "world":
            text = f"{told['overruns']:,} overruns, {jitter}"
        else:
            share = _text(told["late_share"], ".1f", 100)
            age = _spread("age", told["command_age_ms"])
            text = f"{share} % of commands, {told['held']} held, {told['damped']} damped; "
            text += f"{age}; {jitter}"
        shown.append((f"{name} late", text))
    return shown


def _spread(name: str, of: Mapping[str, float]) -> str:
    return f"{name} " + " / ".join(f"{value:.3g}" for value in of.values()) + " ms" if of else name


def _against_truth(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    if s["distance"] is None:
        return [("world time", f"{s['duration']:.1f} s, without truth to compare anything with")]
    return [
        ("distance", f"{_text(s['distance'], '.2f')} m in {s['duration']:.1f} s"),
        (
            "mean speed",
            f"vx {_text(s['mean_vx'], '+.3f')}, vy {_text(s['mean_vy'], '+.3f')} m/s, "
            f"wz {_text(s['mean_wz'], '+.3f')} rad/s",
        ),
        (f"RMSE from {s['steady_from']:.1f} s", _errors(s["rmse"])),
        (f"estimator ({s['estimator']}) RMSE", _errors(s["estimator_rmse"])),
        ("yoke drift", f"at most {_text(s['yoke_drift_max'], '.2f', 1e3)} mm"),
    ]


def _counted(counters: Mapping[str, Mapping[str, int]]) -> str:
    """Sums over the robots of what their last statuses count."""
    total = sum((Counter(counts) for counts in counters.values()), Counter[str]())
    return ", ".join(f"{name} {count:,}" for name, count in sorted(total.items()))


def _planner(s: Mapping[str, Any]) -> str:
    if not s["planner_solves"]:
        return f"{s['planner']}, no solves"
    return f"{s['planner']}, {_times(s, 'planner_ms', 'ms', '.2f')}"


def _errors(rmse: Mapping[str, float | None]) -> str:
    parts = []
    for name, value in rmse.items():
        unit, factor = _ERRORS[name]
        digits = ".1f" if factor > 1.0 else ".4f"
        parts.append(f"{name} {_text(value, digits, factor)} {unit}")
    half = (len(parts) + 1) // 2
    return ", ".join(parts[:half]) + "\n" + ", ".join(parts[half:])


def _times(s: Mapping[str, Any], name: str, unit: str, digits: str) -> str:
    median, p99 = s[f"{name}_median"], s[f"{name}_p99"]
    return f"median {_text(median, digits)} {unit}, p99 {_text(p99, digits)} {unit}"


def _text(value: float | None, digits: str, factor: float = 1.0) -> str:
    return "–" if value is None else format(value * factor, digits)
