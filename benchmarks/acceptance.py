"""Walk what the project promises, process by process over the bus, and compare with its limits.

Run: python -m benchmarks.acceptance [NAME ...] [--out DIR]     (all of it: about an hour)

Every scenario is a `quadriga walk` of its own; the table and DIR/acceptance.json say what came
of each seed, the limits it is held against and whether it met them.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

FLAT = ("--terrain", "flat", "--seconds", "20")


@dataclass(frozen=True)
class AcceptanceScenario:
    """Options of `quadriga walk`, its seeds, and whether the tolerances of flat ground hold."""

    options: tuple[str, ...]
    seeds: tuple[int, ...] = (0, 1, 2)
    tolerances: bool = False
    steady_vx: float = 0.5


SCENARIOS = {
    "flat-1": AcceptanceScenario(("--robots", "1", *FLAT), tolerances=True),
    "flat-2": AcceptanceScenario(("--robots", "2", *FLAT), tolerances=True),
    "flat-3": AcceptanceScenario(("--robots", "3", *FLAT), tolerances=True),
    "flat-5": AcceptanceScenario(("--robots", "5", *FLAT), tolerances=True),
    "heightfield-5": AcceptanceScenario(
        ("--robots", "5", "--terrain", "heightfield", "--terrain-height", "0.05",
         "--payload", "10", "--seconds", "15")
    ),
    "boxes-3": AcceptanceScenario(
        ("--robots", "3", "--terrain", "boxes", "--terrain-height", "0.04", "--payload", "4.5",
         "--seconds", "15")
    ),
    "turn-3": AcceptanceScenario(("--robots", "3", "--wz", "0.3", "--seconds", "8")),
    "realtime-1": AcceptanceScenario(("--robots", "1", "--mode", "realtime", "--seconds", "10")),
}  # fmt: skip


def verdict(scenario: AcceptanceScenario, status: int, figures: dict[str, Any]) -> str:
    """What of the promise was not kept; empty if all was."""
    missed = []
    if status:
        missed.append(f"exit status {status}")
    if figures.get("fell", True):
        missed.append(f"fell: {', '.join(figures.get('fallen', ['?']))}")
    if scenario.tolerances and figures:
        rmse = figures["rmse"]
        limits = {
            "mean vx": (abs(figures["mean_vx"] - scenario.steady_vx), 0.02),
            "vx": (rmse["vx"], 0.03),
            "z": (rmse["z"], 0.010),
            "roll": (rmse["roll"], 0.04),
            "pitch": (rmse["pitch"], 0.04),
            "yoke": (figures["yoke_drift_max"] or 0.0, 0.002),
        }
        missed += [f"{k} {got:.4f} > {limit}" for k, (got, limit) in limits.items() if got > limit]
    return "; ".join(missed)


def main() -> int:
    """Walk the scenarios asked for; 0 if every promise was kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[], metavar="NAME", help=", ".join(SCENARIOS))
    parser.add_argument("--out", type=Path, default=Path("runs/acceptance"))
    parser.add_argument("--seeds", type=int, nargs="+", help="instead of 0 1 2")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - SCENARIOS.keys())
    if unknown:
        parser.error(f"no scenario {', '.join(unknown)}; there are {', '.join(SCENARIOS)}")
    table = Table(
        "scenario", "seed", "missed", "vx", "RMSE z mm, vx, roll, pitch", "yoke mm", "rtf", "gaps"
    )
    results: dict[str, Any] = {}
    console = Console()
    for name in arguments.names or SCENARIOS:
        scenario = SCENARIOS[name]
        for seed in arguments.seeds or scenario.seeds:
            out = arguments.out / f"{name}-{seed}"
            command = [
                sys.executable,
                "-m",
                "quadriga",
                "walk",
                *scenario.options,
                "--seed",
                str(seed),
                "--no-render",
                "--out",
                str(out),
            ]
            status = subprocess.run(command, check=False).returncode
            file = out / "summary.json"
            figures = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
            missed = verdict(scenario, status, figures)
            results[f"{name}-{seed}"] = {"missed": missed, "summary": figures}
            if figures:
                rmse = figures["rmse"]
                table.add_row(
                    name,
                    str(seed),
                    missed or "-",
                    f"{figures['mean_vx']:.3f}",
                    f"{1e3 * rmse['z']:.1f}, {rmse['vx']:.4f}, {rmse['roll']:.4f}, "
                    f"{rmse['pitch']:.4f}",
                    f"{1e3 * (figures['yoke_drift_max'] or 0.0):.2f}",
                    f"{figures['real_time_factor']:.2f}",
                    str(figures["gaps"]),
                )
            else:
                table.add_row(name, str(seed), missed, "", "", "", "", "")
    (arguments.out / "acceptance.json").write_text(json.dumps(results, indent=2), encoding="utf-8")
    console.print(table)
    return int(any(result["missed"] for result in results.values()))


if __name__ == "__main__":
    sys.exit(main())
