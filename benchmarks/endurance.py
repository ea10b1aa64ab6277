"""A long walk in real time: does memory grow, does anything get lost, does anybody fall?

`python -m benchmarks.endurance` walks two robots for 30 minutes, prints the memory of each process
over time, and ends with 1 if one grew by more than 5 %, a robot fell or the recording has a gap.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.identification.predictors import ensure_predictor
from quadriga.recordings.summary import summarise
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.process_use import read_use
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from quadriga.tables import Table, print_tables
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.run_folder import CONFIG, make_run_dir
from quadriga.warm_up import warm_up

_EVERY_S: Final = 10.0
_SETTLED: Final = 0.1  # share of the walk after which memory must not grow any more
_MOST: Final = 0.05  # share by which it may
_INTERRUPTED: Final = 130
_PASSED: Final = "states_passed_over"
_STAND_MS: Final = 9000  # at first: robots that have stood so long know how fast their yaw drifts

Samples = dict[str, list[tuple[float, float]]]  # by process: s since the start, MB


def main() -> int:
    """Walk, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--robots", type=int, default=2)
    parser.add_argument("--planner", default="distributed")
    parser.add_argument("--seed", type=int, default=0, help="of the world")
    parser.add_argument("--out", type=Path, metavar="DIR", help="run folder (runs/<date>-<time>)")
    given = parser.parse_args()
    interrupt_on_sigterm()
    try:
        keys = {
            "team.robots": given.robots,
            "world.mode": "realtime",
            "world.seed": given.seed,
            "world.duration": 60.0 * given.minutes,
            "planner.kind": given.planner,
            "gait.stand_ms": _STAND_MS,
            "team.auto_resume": True,
        }
        return endure(load(None, keys), given.out, Console(highlight=False))
    except QuadrigaError as error:
        print(f"endurance: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return _INTERRUPTED


def endure(config: Config, out: Path | None, console: Console) -> int:
    """Walk once and judge; 0 if nothing grew, nothing was lost and nobody fell."""
    folder = make_run_dir(out)
    warm_up(config, console)
    predictor = None
    if find_kind(config.planner.kind).needs_predictor:
        predictor = ensure_predictor(config, console)
    config = replace(config, bus=replace(config.bus, endpoint=free_endpoint()))
    (folder / CONFIG).write_text(to_toml(config), encoding="utf-8")
    samples = _walk(config, folder, predictor, console)
    summary = summarise(folder)
    growth = {name: grown(found) for name, found in samples.items()}
    print_tables([_table(samples, growth)])
    lost = summary["gaps"]
    fallen = ", ".join(summary["fallen"]) or "nobody"
    console.print(f"fell: {fallen}; lost messages: {lost}; end: {summary['end']}", markup=False)
    parts = (f"{key} {count}" for key, count in summary["gaps_per_topic"].items() if count)
    console.print(f"lost by topic: {', '.join(parts) or 'none'}", markup=False)
    rows = summary["realtime"].items()
    late = (f"{name} {_percent(row['late_share'])}" for name, row in rows if name != "world")
    console.print(f"commands that came late, %: {', '.join(late)}", markup=False)
    passed = (f"{name} {c.get(_PASSED, 0)}" for name, c in summary["counters"].items())
    console.print(f"ticks passed over by late agents: {', '.join(passed)}", markup=False)
    console.print(f"walked {summary['distance']:.0f} m; folder: {folder}", markup=False)
    return int(bool(summary["fallen"]) or lost > 0 or max(growth.values(), default=0.0) > _MOST)


def _walk(config: Config, folder: Path, predictor: Path | None, console: Console) -> Samples:
    samples: Samples = {}
    begun, total = monotonic(), config.world.duration
    rows = process_table(config, folder, predictor, "")
    with Launch(rows, folder / "logs") as launch:
        next_look = begun

        def look() -> bool:
            nonlocal next_look
            now = monotonic()
            if now >= next_look:
                next_look += _EVERY_S
                for name, pid in launch.pids.items():
                    if (use := read_use(pid)) is not None:
                        samples.setdefault(name, []).append((now - begun, 1e-6 * use.memory))
                console.print(f"{now - begun:.0f}/{total:g} s", end="\r", markup=False)
            return False

        launch.watch(look)
    return samples


def grown(samples: list[tuple[float, float]]) -> float:
    """By how much memory has grown since the walk had settled, as a share of what it was then.

    Medians of a tenth of the samples each: those after the first tenth, and the last ones.
    """
    values = [mb for _, mb in samples]
    width = max(1, round(_SETTLED * len(values)))
    early, late = sorted(values[width : 2 * width] or values[:1]), sorted(values[-width:])
    return late[len(late) // 2] / early[len(early) // 2] - 1.0


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f}"


def _table(samples: Samples, growth: Mapping[str, float]) -> Table:
    rows = []
    for name, found in samples.items():
        quarters = [found[(len(found) - 1) * k // 4] for k in range(5)]
        cells = [f"{mb:.1f}" for _, mb in quarters]
        rows.append((name, *cells, f"{100.0 * growth[name]:+.1f}"))
    columns = ("process", "MB at first", "at 1/4", "at 1/2", "at 3/4", "at last", "growth %")
    return Table("Resident memory", columns, tuple(rows))


if __name__ == "__main__":
    sys.exit(main())
