"""The summary of a walk as a table: at its end on the terminal, and on its page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from quadriga.shared.printable import printable
from quadriga.tables import error_text, format_number

# Unit and factor of each of `quadriga.recordings.traces.ERRORS`.
_ERRORS = {
    "z": ("mm", 1e3), "z-over-stance-feet": ("mm", 1e3), "vx": ("m/s", 1.0),
    "vy": ("m/s", 1.0), "roll": ("rad", 1.0), "pitch": ("rad", 1.0), "wz": ("rad/s", 1.0),
}  # fmt: skip
_DEGREES = 57.2957795  # in a rad


def print_summary(summary: dict[str, Any], console: Console) -> None:
    """Show the figures of `quadriga.recordings.summary.summarise` on a terminal."""
    table = Table(show_header=False, title=_build_title(summary), title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, figure in list_figures(summary):
        text = printable(figure)
        bad = name == "recording" or (name == "falls" and text != "none")
        table.add_row(name, f"[red]{escape(text)}[/red]" if bad else escape(text))
    console.print(table)


def _build_title(summary: dict[str, Any]) -> str:
    robots = summary["robots"]
    yoked = "unyoked" if summary["yokes"] == "none" else "yoked"
    team = f"{robots} {yoked} robots" if robots > 1 else "1 robot"
    where = summary["scenario"] or summary["terrain"]
    return f"{team}, {where}, seed {summary['seed']}, {summary['mode']}"


def list_figures(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and text of each figure that there is."""
    shown = [
        ("falls", ", ".join(s["fallen"]) or "none"),
        *_list_motion(s),
        _describe_planner(s),
        ("control tick", _format_times(s, "tick_us", "µs", ".0f")),
        *_list_lateness(s["realtime"]),
        ("real-time factor", format_number(s["real_time_factor"], ".2f")),
        ("messages", f"{s['messages']:,} recorded, {s['gaps']} gaps, {s['invalid']} invalid"),
    ]
    counted = _count_all(s["counters"])
    if counted:
        shown.append(("counted by the agents", counted))
    if s.get("lost"):
        shown.append(("lost", f"{s['lost']:,} messages that did not reach the recorder"))
    if s["end"]:
        shown.append(("end", s["end"]))
    shown += [(f"{robot} stopped", reason) for robot, reason in s["stop_reasons"].items()]
    if s["cut"]:
        shown.append(("recording", s["cut"]))
    return shown


def _list_lateness(realtime: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """In real time how late each robot's commands were, and the world itself."""
    if realtime is None:
        return []
    shown = []
    for name, figures in realtime.items():
        jitter = _format_spread("jitter", figures["jitter_ms"])
        if name == "world":
            text = f"{figures['overruns']:,} overruns, {jitter}"
        else:
            share = format_number(figures["late_share"], ".1f", 100)
            age = _format_spread("age", figures["command_age_ms"])
            text = f"{share} % of commands, {figures['held']} held; {age}; {jitter}"
        shown.append((f"{name} late", text))
    return shown


def _format_spread(name: str, of: Mapping[str, float]) -> str:
    return f"{name} " + " / ".join(f"{value:.3g}" for value in of.values()) + " ms" if of else name


def _list_motion(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    if s["distance"] is None:
        return [("world time", f"{s['duration']:.1f} s, without truth to compare anything with")]
    vx, vy, wz = (format_number(s[f"mean_{name}"], "+.3f") for name in ("vx", "vy", "wz"))
    return [
        ("distance", f"{format_number(s['distance'], '.2f')} m in {s['duration']:.1f} s"),
        ("mean speed", f"vx {vx}, vy {vy} m/s, wz {wz} rad/s"),
        (f"RMSE from {s['steady_from']:.1f} s", _format_errors(s["rmse"])),
        (f"estimator ({s['estimator']}) RMSE", _format_errors(s["estimator_rmse"])),
        ("yoke drift", f"at most {format_number(s['yoke_drift_max'], '.2f', 1e3)} mm"),
    ]


def _count_all(counters: Mapping[str, Mapping[str, int]]) -> str:
    """Sums over the robots of what their last statuses count."""
    total = sum((Counter(counts) for counts in counters.values()), Counter[str]())
    return ", ".join(f"{name} {count:,}" for name, count in sorted(total.items()))


def _describe_planner(s: Mapping[str, Any]) -> tuple[str, str]:
    """Name and text of who plans, or of the controller of one's own that walks."""
    if s.get("controller"):
        return "controller", s["controller"]
    if not s["planner_solves"]:
        return "planner", f"{s['planner']}, no solves"
    return "planner", f"{s['planner']}, {_format_times(s, 'planner_ms', 'ms', '.2f')}"


def _format_errors(rmse: Mapping[str, float | None]) -> str:
    parts = []
    for name, value in rmse.items():
        unit, factor = _ERRORS[name]
        digits = ".1f" if factor > 1.0 else ".4f"
        text = f"{error_text(name)} {format_number(value, digits, factor)} {unit}"
        if unit.startswith("rad"):
            text += f" ({format_number(value, '.2f', _DEGREES)}°{unit.removeprefix('rad')})"
        parts.append(text)
    half = (len(parts) + 1) // 2
    return ", ".join(parts[:half]) + "\n" + ", ".join(parts[half:])


def _format_times(s: Mapping[str, Any], name: str, unit: str, digits: str) -> str:
    median, p99 = s[f"{name}_median"], s[f"{name}_p99"]
    return f"median {format_number(median, digits)} {unit}, p99 {format_number(p99, digits)} {unit}"
