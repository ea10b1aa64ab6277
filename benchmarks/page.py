"""The benchmark's page: the figures of each part in a few lines, and their limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from rich.table import Table

Part = dict[str, Any]
# Key, sign, limit; a dot leads to the size of the team.
TARGETS: Final[Sequence[tuple[str, str, float]]] = (
    ("planner_tick_ratio_median", ">=", 40.0), ("planner_constrained_ratio_p99", ">=", 40.0),
    ("low_level_us_median", "<=", 150.0), ("rtf.3", ">=", 1.5), ("rtf.5", ">=", 0.8),
    ("rtf.10", ">=", 0.5), ("messaging_share.3", "<=", 0.55),
    ("recorder_msgs_per_s", ">=", 19_900.0), ("recorder_gaps", "<=", 0.0),
)  # fmt: skip
_WIDTH: Final = 11


def headline(parts: dict[str, Part]) -> dict[str, Any]:
    """The figures that other programs read; None where a part was left out."""
    low, walks, recorder = (parts.get(name, {}) for name in ("low-level", "walks", "recorder"))
    rows = walks.get("rows", [])
    plans = {row["problem"]: row for row in parts.get("planner", {}).get("rows", [])}
    step = plans.get("eq. 12, with the peers' terms", {})
    return {
        "planner_tick_ratio_median": step.get("ratio_median"),
        "planner_constrained_ratio_p99": step.get("bound_ratio_p99"),
        "low_level_us_median": low["hot"]["median"] if low else None,
        "low_level_us_cold_median": low["cold"]["median"] if low else None,
        "rtf": {str(row["robots"]): row["rtf"] for row in rows},
        "messaging_share": {str(row["robots"]): messaging_share(row) for row in rows},
        "recorder_msgs_per_s": recorder.get("per_s"),
        "recorder_gaps": recorder.get("gaps"),
        "recorder_core_share": recorder.get("core"),
    }


def messaging_share(row: Part) -> float:
    """Share of a tick over the bus beyond physics and control one after the other.

    Over the bus robots compute in parallel, so on several cores this is less than the time of
    messages and waiting, and may be negative.
    """
    return 1.0 - float(row["alone"]["tick_us"] / row["tick_us"])


def section(name: str, part: Part) -> Table:
    """A part's lines, its name before the first."""
    shown = Table.grid(padding=(0, 1))
    shown.add_column(width=_WIDTH, style="bold")
    shown.add_column()
    for k, line in enumerate(LINES[name](part)):
        shown.add_row("" if k else name, line)
    return shown


def targets(figures: dict[str, Any]) -> Table:
    """The figures that have a limit; one without a value was not measured, and is not met."""
    shown = Table.grid(padding=(0, 1))
    for key, sign, limit in TARGETS:
        name, _, size = key.partition(".")
        value = figures[name].get(size) if size else figures.get(name)
        held_to = f"held to {sign} {limit:,g}:"
        if value is None:
            shown.add_row(key, "–", f"{held_to} not measured")
            continue
        met = value >= limit if sign == ">=" else value <= limit
        shown.add_row(key, f"{value:,.4g}", f"{held_to} {'met' if met else '[red]MISSED[/red]'}")
    return shown


def _machine(part: Part) -> list[str]:
    return [
        f"{part['cores']} cores, {part['processor']}, load {part['load']:.1f}; scheduling: "
        f"{part['scheduling']}; BLAS threads: {part['blas_threads']}",
        f"Python {part['python']}, Zenoh {part['eclipse-zenoh']}, Pinocchio {part['pin']}, "
        f"MuJoCo {part['mujoco']}, numba {part['numba']}, numpy {part['numpy']}",
    ]


def _planner(part: Part) -> list[str]:
    lines = []
    for row in part["rows"]:
        bound = "no plan at a bound"
        if row["bound_plans"]:
            bound = f"{row['bound_plans']:.0f} plans at a bound: {_plan(row, 'bound_')}"
        lines.append(
            f"n = {row['robots']}, {row['problem']}: {_plan(row, '')}; {bound}; largest error "
            f"{row['force_error_n']:.1g} N, as written {row['written_force_error_n']:.1g} N"
        )
    return lines


def _plan(row: Part, prefix: str) -> str:
    """What plans take, and the paper's way as a multiple of it."""
    median, p99, times, times_p99 = (
        row[prefix + name] for name in ("median_ms", "p99_ms", "ratio_median", "ratio_p99")
    )
    return f"{median:.3f} ms, p99 {p99:.3f} (as written × {times:.0f}, × {times_p99:.0f})"


def _low_level(part: Part) -> list[str]:
    lines = []
    for name in ("hot", "cold"):
        figures = part[name]
        stages = ", ".join(f"{stage} {us:.1f}" for stage, us in figures["stages"].items())
        lines.append(f"{name}: {figures['median']:.0f} µs, p99 {figures['p99']:.0f}: {stages}")
    return lines


def _bus(part: Part) -> list[str]:
    return [
        f"n = {row['robots']}, messages of a tick: {row['bus']['median']:.0f} µs, p99 "
        f"{row['bus']['p99']:.0f}; sockets {row['socket']['median']:.0f}, p99 "
        f"{row['socket']['p99']:.0f} (× {row['bus']['median'] / row['socket']['median']:.1f})"
        for row in part["rows"]
    ]


def _recorder(part: Part) -> list[str]:
    return [
        f"{part['per_s']:,.0f} messages/s of {part['asked_per_s']:,.0f} asked for, "
        f"{part['gaps']:.0f} gaps, {100 * part['core']:.0f} % of a core"
    ]


def _fit(part: Part) -> list[str]:
    return [
        f"n = {row['robots']}, T = {row['samples']}: {row['seconds']:.2f} s, at most "
        f"{row['most_seconds']:g} s; peak {row['peak_gb']:.2f} GB"
        f"{'' if row['kept'] else '; a limit is MISSED'}"
        for row in part["rows"]
    ]


def _walks(part: Part) -> list[str]:
    lines = []
    for row in part["rows"]:
        alone, asked = row["alone"], part["seconds"]
        early = "" if row["seconds"] > asked - 0.1 else f"; ENDED at {row['seconds']:.1f} s"
        lines.append(
            f"n = {row['robots']}: {row['rtf']:.2f} × real time, tick {row['tick_us']:.0f} µs; in "
            f"one process {alone['tick_us']:.0f} = physics {alone['physics_us']:.0f} + control "
            f"{alone['controllers_us']:.0f} + planning {alone['planners_us']:.0f}; messaging "
            f"{100 * messaging_share(row):.0f} %{early}"
        )
        lines.append("  " + _memory(row["memory_mb"]))
    return lines


def _memory(figures: dict[str, dict[str, float]]) -> str:
    """RSS (PSS) by process, of all robots the largest."""
    robots = [name for name in figures if name[1:].isdigit()]
    shown = {name: m for name, m in figures.items() if name not in robots and m}
    if robots:
        largest = max(robots, key=lambda name: figures[name].get("rss", 0.0))
        shown = {"largest agent": figures[largest], **shown}
    cells = (f"{name} {m['rss']:.0f} ({m['pss']:.0f})" for name, m in shown.items() if m)
    total = sum(m.get("pss", 0.0) for m in figures.values())
    return f"MB (of it own): {', '.join(cells)}; all {total:.0f}"


LINES: Final[dict[str, Callable[[Part], list[str]]]] = {
    "machine": _machine, "planner": _planner, "low-level": _low_level, "bus": _bus,
    "recorder": _recorder, "fit": _fit, "walks": _walks,
}  # fmt: skip
